"""Parts: random specs in their number types, verified some at a time.

Resumable: a part whose Programs, C and engine are the same is not run again.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from codegen.emit.c_module import emit_c_files
from language.ir.printer import digest
from language.ir.program import Program
from tests.lockstep.random_specs.spec import Spec
from tests.validation.evidence.evidence_store import ROOT, Figure, write_json

PART = 20
"""Specs of a part: a kill loses less than a minute."""
HITS = 20
"""Least number of times that all specs do each thing that is counted."""
Programs = list[tuple[Spec, Program]]


def verify_parts(
    about: str | None,
    name: str,
    full: int,
    programs: Callable[[range, Path], Programs],
    part: Callable[[Programs, Path], Figure],
) -> tuple[list[Figure], int]:
    """Return all parts, those that are missing run now, and the least number of hits.

    `name` names the specs, their option and the file of evidence; `full` is how many there are.
    """
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument(f"--{name}", dest="count", type=int, default=full)
    count: int = parser.parse_args().count
    os.chdir(ROOT)
    evidence = ROOT / "docs" / "evidence" / f"random_{name}.json"
    found: dict[str, Any] = json.loads(evidence.read_text()) if evidence.exists() else {}
    for start in range(0, count, PART):
        with tempfile.TemporaryDirectory() as folder:
            pairs = programs(range(start, min(count, start + PART)), Path(folder))
            key = _key_of(pairs)
            if found.get(str(start), {}).get("digest") == key:
                continue
            found[str(start)] = {"digest": key, **part(pairs, Path(folder))}
        write_json(evidence, found, sort_keys=True)
        print(f"{name} {start} to {start + PART - 1}: {found[str(start)]['bits']}", flush=True)
    return [found[str(start)] for start in range(0, count, PART)], -(-HITS * count // full)


def _key_of(pairs: Programs) -> str:
    """Return the digest of what runs: the Programs, their C, the engine."""
    total = hashlib.sha256()
    for path in sorted((ROOT / "engine").rglob("*.py")):
        total.update(path.read_bytes())
    for _, made in pairs:
        total.update("".join((digest(made), *emit_c_files(made).values())).encode())
    return total.hexdigest()
