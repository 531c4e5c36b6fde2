"""Vectors: whether the compiler makes code over those that tracks are written in."""

from __future__ import annotations

import subprocess
from functools import cache

from codegen.build import SECONDS, compiler


def has_vectors() -> bool:
    """Tell whether the compiler is a GCC for x86-64: tracks use its vectors. Raises ToolMissing."""
    return _has_vectors(tuple(compiler()))


@cache
def _has_vectors(command: tuple[str, ...]) -> bool:
    asked = [*command, "-dM", "-E", "-x", "c", "-"]
    try:
        told = subprocess.run(asked, input="", capture_output=True, text=True, timeout=SECONDS)
    except (OSError, subprocess.TimeoutExpired):
        return False
    known = {line.split()[1] for line in told.stdout.splitlines() if line.startswith("#define ")}
    return {"__GNUC__", "__x86_64__"} <= known and "__clang__" not in known
