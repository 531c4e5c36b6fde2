"""Vectors: whether the compiler makes code over those that tracks are written in."""

from __future__ import annotations

import subprocess
from functools import cache

from codegen.build import TIMEOUT, find_compiler


def has_gcc_vectors() -> bool:
    """Tell whether the compiler is a GCC for x86-64: tracks use its vectors. Raises ToolMissing."""
    return _has_gcc_vectors(tuple(find_compiler()))


@cache
def _has_gcc_vectors(command: tuple[str, ...]) -> bool:
    query = [*command, "-dM", "-E", "-x", "c", "-"]
    try:
        result = subprocess.run(query, input="", capture_output=True, text=True, timeout=TIMEOUT)
    except (OSError, subprocess.TimeoutExpired):
        return False
    macros = {line.split()[1] for line in result.stdout.splitlines() if line.startswith("#define ")}
    return {"__GNUC__", "__x86_64__"} <= macros and "__clang__" not in macros
