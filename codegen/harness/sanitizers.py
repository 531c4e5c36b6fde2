"""Sanitizers: builds and runs programs with checks for memory errors and undefined behaviour."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.toolchain.compiler import FLAGS, BuildError, convert_process_errors
from codegen.toolchain.external_tools import output_of

SANITIZERS = "address,undefined,float-divide-by-zero,float-cast-overflow"
"""The sanitizers of gcc and clang that are enabled."""
ERROR_MARKERS = ("runtime error", "ERROR: AddressSanitizer")
"""Texts that mark an error in the output of a sanitizer."""
APP = "app"
"""The name of the executable."""


@dataclass(frozen=True)
class SanitizerReport:
    """The error output of a program under sanitizers, and its first error, if any."""

    lines: tuple[str, ...]
    findings: tuple[str, ...]


def build_sanitised(compiler: str, sources: Sequence[Path], folder: Path, extra: str = "") -> Path:
    """Compile C files with SANITIZERS at -O1; return the executable APP in `folder`.

    `extra` is put before the list of sanitizers, with its own comma, like `fuzzer,`. Raises
    MissingToolError, BuildError.
    """
    flags = [flag for flag in FLAGS if flag != "-O2"]
    sanitizers = [f"-fsanitize={extra}{SANITIZERS}", "-fno-sanitize-recover=all"]
    command = [compiler, *flags, "-O1", "-g", *sanitizers, *map(str, sources), "-o", APP, "-lm"]
    output_of(command, folder)
    return folder / APP


def run_sanitised(
    app: Path, arguments: Sequence[str] = (), stdin: bytes = b"", timeout: float | None = None
) -> SanitizerReport:
    """Run a sanitised program in its folder and return its error output with its first error.

    `findings` has at most one text: the first line with one of ERROR_MARKERS, from its last slash
    on; without such a line, a nonzero exit code. Leaks are not searched. Raises
    BrokenToolError if the program does not start, and BuildError after `timeout` seconds.
    """
    options = os.environ | {"ASAN_OPTIONS": "detect_leaks=0"}
    with convert_process_errors("the compiled program", BuildError):
        done = subprocess.run(
            [str(app), *arguments],
            cwd=app.parent,
            input=stdin,
            capture_output=True,
            env=options,
            timeout=timeout,
            check=False,
        )
    lines = tuple(done.stderr.decode(errors="replace").splitlines())
    findings = [line.strip() for line in lines if any(word in line for word in ERROR_MARKERS)]
    if done.returncode and not findings:
        findings = [f"the program ended with {done.returncode}: {' '.join(lines[-1:])}"]
    return SanitizerReport(lines, tuple(text.rpartition("/")[2] for text in findings[:1]))
