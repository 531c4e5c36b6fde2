"""Sanitizers: compilers' own checks of addresses and of what C leaves undefined, while C runs."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.build import FLAGS, BuildError
from codegen.tool import output_of

CHECKED = "address,undefined,float-divide-by-zero,float-cast-overflow"
FOUND = ("runtime error", "ERROR: AddressSanitizer")
APP = "app"


@dataclass(frozen=True)
class Sanitised:
    """What a program under sanitizers said: its `lines`, and the first thing that was `found`."""

    lines: tuple[str, ...]
    found: tuple[str, ...]


def built(compiler: str, sources: Sequence[Path], folder: Path, beside: str = "") -> Path:
    """Return the program made of sources, with the sanitizers `beside` the usual ones.

    Raises ToolMissing, BuildError.
    """
    flags = [flag for flag in FLAGS if flag != "-O2"]
    sanitizers = [f"-fsanitize={beside}{CHECKED}", "-fno-sanitize-recover=all"]
    command = [compiler, *flags, "-O1", "-g", *sanitizers, *map(str, sources), "-o", APP, "-lm"]
    output_of(command, folder)
    return folder / APP


def ran(
    app: Path, words: Sequence[str] = (), given: bytes = b"", seconds: float | None = None
) -> Sanitised:
    """Run a program in its folder, for so many seconds at most. Raises BuildError."""
    options = os.environ | {"ASAN_OPTIONS": "detect_leaks=0"}
    try:
        done = subprocess.run(
            [str(app), *words],
            cwd=app.parent,
            input=given,
            capture_output=True,
            env=options,
            timeout=seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise BuildError(f"the compiled program was not done after {seconds} s") from None
    lines = tuple(done.stderr.decode(errors="replace").splitlines())
    found = [line.strip() for line in lines if any(word in line for word in FOUND)]
    if done.returncode and not found:
        found = [f"the program ended with {done.returncode}: {' '.join(lines[-1:])}"]
    return Sanitised(lines, tuple(text.rpartition("/")[2] for text in found[:1]))
