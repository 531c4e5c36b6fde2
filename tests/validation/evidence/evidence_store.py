"""Store: the figures of a subject, with the digest of the code that gave them.

A figure that was measured with the same code is not measured again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[3]
CODE = ("language", "engine", "codegen", "expectation", "lockstep", "sweep", "modewright", "spec")
DIAGNOSIS = "diagnosis"
"""The subject whose figures depend on the package `diagnosis` too."""
SUFFIXES = (".py", ".yaml", ".lark", ".jinja", ".txt", ".c", ".h", ".ld")
Figure = dict[str, Any]


def measure_figures(subject: str, figures: Mapping[str, Callable[[], Figure]]) -> int:
    """Measure what is not measured yet, keep and print all; return 0 if every bar is met."""
    path = ROOT / "docs" / "evidence" / f"{subject}.json"
    digest = code_digest((*CODE, "diagnosis") if subject == DIAGNOSIS else CODE)
    old = json.loads(path.read_text()) if path.exists() else {}
    kept: dict[str, Figure] = old.get("figures", {}) if old.get("code") == digest else {}
    for name, measure in figures.items():
        if name not in kept:
            print(f"measuring {name} ...", flush=True)
            kept[name] = measure()
            _write(path, subject, digest, kept)
    for name, figure in kept.items():
        print(f"{'met   ' if figure['met'] else 'MISSED'} {name}: {json.dumps(figure)}")
    _write(path, subject, digest, kept)
    return 0 if all(figure["met"] for figure in kept.values()) else 1


def code_digest(folders: Sequence[str] = CODE) -> str:
    """Return the SHA-256 of all code and specs in some folders."""
    total = hashlib.sha256()
    for folder in folders:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.is_file() and path.suffix in SUFFIXES:
                total.update(str(path.relative_to(ROOT)).encode() + b"\0" + path.read_bytes())
    return total.hexdigest()


def _write(path: Path, subject: str, digest: str, figures: Mapping[str, Figure]) -> None:
    write_json(path, {"subject": subject, "code": digest, "figures": figures})


def write_json(path: Path, known: Mapping[str, Any], sort_keys: bool = False) -> None:
    """Write what is known as JSON, whole or not at all."""
    path.parent.mkdir(exist_ok=True)
    temporary = path.with_suffix(".tmp")
    temporary.write_text(json.dumps(known, indent=1, sort_keys=sort_keys) + "\n")
    temporary.replace(path)
