"""Sources: all that a diagnosis was made from, each with its hash, and what it was made with."""

from __future__ import annotations

import hashlib
import platform
from importlib import metadata

from codegen.build import BuildError, compiler_version
from codegen.rendering import version
from diagnosis.dossier import Dossier
from diagnosis.layers import shipped_effects
from diagnosis.recipe import node_text
from language.missing import ToolMissing

DIGITS = 16
"""Hexadecimal digits of SHA-256 that are told."""


def sources(dossier: Dossier) -> list[tuple[str, str, str]]:
    """Return use, name and hash of each file and spec."""
    case = dossier.case
    effects = case.effects if case.effects is not None else shipped_effects()
    library = "\n".join(f"{one.name} {node_text(one.body)}" for one in effects)
    columns = "\n".join(case.mapping.span.source.lines)
    found = [
        ("spec, with all that it extends", dossier.name, _digest(node_text(case.document.root))),
        ("map of columns", case.mapping.name, _digest(columns) if columns else ""),
        ("effects", f"{len(effects)} of them", _digest(library)),
    ]
    found += [("training", name, digest) for name, digest in dossier.verdict.inputs.items()]
    found += [("held out", name, digest) for name, digest in dossier.held_out.items()]
    return found


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:DIGITS]


def tools() -> str:
    """Return the versions of what a diagnosis was made with."""
    try:
        compiler = compiler_version().partition(": ")[2]
    except (BuildError, ToolMissing):
        compiler = "no C compiler"
    python = f"Python {platform.python_version()}"
    libraries = [f"{name} {metadata.version(name)}" for name in ("numpy", "scipy")]
    return ", ".join([f"modewright {version()}", python, *libraries, compiler])
