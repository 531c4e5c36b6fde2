"""Sanitizers: compilers' own checks of addresses and of what C leaves undefined, while C runs."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.toolchain.compiler import FLAGS, BuildError
from codegen.toolchain.external_tools import output_of

SANITIZERS = "address,undefined,float-divide-by-zero,float-cast-overflow"
ERROR_MARKERS = ("runtime error", "ERROR: AddressSanitizer")
APP = "app"


@dataclass(frozen=True)
class SanitizerReport:
    """What a program under sanitizers said: its `lines`, and the first thing that was `found`."""

    lines: tuple[str, ...]
    findings: tuple[str, ...]


def build_sanitised(compiler: str, sources: Sequence[Path], folder: Path, extra: str = "") -> Path:
    """Return the program made of sources, with the sanitizers `extra` the usual ones.

    Raises ToolMissing, BuildError.
    """
    flags = [flag for flag in FLAGS if flag != "-O2"]
    sanitizers = [f"-fsanitize={extra}{SANITIZERS}", "-fno-sanitize-recover=all"]
    command = [compiler, *flags, "-O1", "-g", *sanitizers, *map(str, sources), "-o", APP, "-lm"]
    output_of(command, folder)
    return folder / APP


def run_sanitised(
    app: Path, arguments: Sequence[str] = (), stdin: bytes = b"", timeout: float | None = None
) -> SanitizerReport:
    """Run a program in its folder, for so many seconds at most. Raises BuildError."""
    options = os.environ | {"ASAN_OPTIONS": "detect_leaks=0"}
    try:
        done = subprocess.run(
            [str(app), *arguments],
            cwd=app.parent,
            input=stdin,
            capture_output=True,
            env=options,
            timeout=timeout,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise BuildError(f"the compiled program was not done after {timeout} s") from None
    lines = tuple(done.stderr.decode(errors="replace").splitlines())
    findings = [line.strip() for line in lines if any(word in line for word in ERROR_MARKERS)]
    if done.returncode and not findings:
        findings = [f"the program ended with {done.returncode}: {' '.join(lines[-1:])}"]
    return SanitizerReport(lines, tuple(text.rpartition("/")[2] for text in findings[:1]))
