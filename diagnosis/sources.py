"""Sources: all that a diagnosis was made from, each with its hash, and what it was made with."""

from __future__ import annotations

import hashlib
import platform
from importlib import metadata

from codegen.toolchain.compiler import BuildError, compiler_version
from codegen.toolchain.templates import product_version
from diagnosis.dossier import DiagnosisReport
from diagnosis.layers import shipped_effects
from diagnosis.recipe import node_text
from language.text.diagnostic import MissingToolError

DIGEST_LENGTH = 16
"""Hexadecimal digits of SHA-256 that are told."""


def provenance_rows(report: DiagnosisReport) -> list[tuple[str, str, str]]:
    """Return use, name and hash of each file and spec."""
    case = report.case
    effects = case.effects if case.effects is not None else shipped_effects()
    library = "\n".join(f"{one.name} {node_text(one.body)}" for one in effects)
    columns = "\n".join(case.mapping.span.source.lines)
    found = [
        (
            "spec, with all that it extends",
            report.name,
            _text_digest(node_text(case.document.root)),
        ),
        ("map of columns", case.mapping.name, _text_digest(columns) if columns else ""),
        ("effects", f"{len(effects)} of them", _text_digest(library)),
    ]
    found += [("training", name, digest) for name, digest in report.verdict.inputs.items()]
    found += [("held out", name, digest) for name, digest in report.held_out.items()]
    return found


def _text_digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:DIGEST_LENGTH]


def tool_versions() -> str:
    """Return the versions of what a diagnosis was made with."""
    try:
        compiler = compiler_version().partition(": ")[2]
    except (BuildError, MissingToolError):
        compiler = "no C compiler"
    python = f"Python {platform.python_version()}"
    libraries = [f"{name} {metadata.version(name)}" for name in ("numpy", "scipy")]
    return ", ".join([f"modewright {product_version()}", python, *libraries, compiler])
