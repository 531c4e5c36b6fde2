"""Compiler: compiles generated C with the flags that define its bits (rules C3 and C24)."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

from language.text.diagnostic import MissingToolError

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-fast-math", "-fno-math-errno")
"""The flags that define the bits of results."""

WARNINGS = [
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Wconversion",
    "-Wfloat-conversion",
    "-Wdouble-promotion",
    "-Wshadow",
    "-Wundef",
    "-Wstrict-prototypes",
    "-Wmissing-prototypes",
    "-Wcast-qual",
    "-Wswitch-default",
    "-Wswitch-enum",
    "-Wvla",
]
"""The warnings under which generated C compiles without a message."""

TIMEOUT = 120
"""Time limit of a compilation or a run [s]."""


class BuildError(Exception):
    """Generated code does not compile or run, which is a defect of the product.

    The message is that of the compiler or of the program.
    """


def find_compiler(name: str | None = None) -> list[str]:
    """Return the command of the C compiler: `name`, else $CC, else the first of cc, gcc and clang.

    `name` and $CC are split into words like a shell command. Raises MissingToolError if the first
    word is not an installed program.
    """
    requested = shlex.split(name or os.environ.get("CC", ""))
    for candidate in [requested] if requested else [["cc"], ["gcc"], ["clang"]]:
        if shutil.which(candidate[0]):
            return candidate
    executable = requested[0] if requested else "cc"
    raise MissingToolError(
        f"the C compiler `{executable}` is missing: apt-get install gcc libc6-dev"
    )


def flags_at_level(level: str) -> tuple[str, ...]:
    """Return FLAGS with another optimisation level instead of -O2, for example `O3`."""
    return tuple(f"-{level}" if flag == "-O2" else flag for flag in FLAGS)


def compiler_version(name: str | None = None) -> str:
    """Return `path: line`: the resolved path of the compiler, the first line of its version text.

    The exit code is ignored. `name` is that of `find_compiler`. Raises MissingToolError; BuildError
    if it cannot be started or does not end in TIMEOUT seconds.
    """
    command = find_compiler(name)
    try:
        done = subprocess.run(
            [*command, "--version"], capture_output=True, text=True, timeout=TIMEOUT, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise BuildError(f"the C compiler `{command[0]}` does not run: {error}") from None
    first = (done.stdout or done.stderr).strip().split("\n")[0]
    return f"{os.path.realpath(shutil.which(command[0]) or command[0])}: {first}"


def compile_program(
    sources: Sequence[Path],
    target: Path,
    flags: Sequence[str] = FLAGS,
    compiler_name: str | None = None,
) -> None:
    """Compile sources with WARNINGS into an executable or a library, according to `flags`.

    Warnings are no errors. Raises MissingToolError, BuildError.
    """
    run_compiler(
        [*find_compiler(compiler_name), *flags, *WARNINGS, *map(str, sources), "-lm"], target
    )


def run_compiler(command: Sequence[str], target: Path) -> None:
    """Run a compiler command with `-o target` appended.

    Raises BuildError for a nonzero exit code, with its output from the first error on, and after
    TIMEOUT seconds. Warnings are dropped.
    """
    try:
        done = subprocess.run(
            [*command, "-o", str(target)], capture_output=True, text=True, timeout=TIMEOUT
        )
    except subprocess.TimeoutExpired:
        raise BuildError(f"the compiler was not done after {TIMEOUT} s") from None
    if done.returncode != 0:
        raise BuildError(_first_error(done.stderr) or f"the compiler ended with {done.returncode}")


def run_executable(
    target: Path, records: bytes, extra_environment: Mapping[str, str] | None = None
) -> bytes:
    """Run an executable with input records as its standard input; return its standard output.

    `extra_environment` is added to the environment. Raises BuildError for a nonzero exit code and
    after TIMEOUT seconds.
    """
    environment = {**os.environ, **(extra_environment or {})}
    try:
        done = subprocess.run(
            [str(target)], input=records, capture_output=True, env=environment, timeout=TIMEOUT
        )
    except subprocess.TimeoutExpired:
        raise BuildError(f"the compiled program was not done after {TIMEOUT} s") from None
    if done.returncode != 0:
        raise BuildError(f"the compiled program ended with {done.returncode}")
    return done.stdout


def _first_error(text: str) -> str:
    """Return the output of a compiler from its first error on; all of it if it has none."""
    lines = text.strip().splitlines()
    first = next((k for k, line in enumerate(lines) if "error:" in line), 0)
    return "\n".join(lines[first:])


def has_gcc_vectors() -> bool:
    """Tell whether the compiler is GCC for x86-64, whose vector extensions SIMD code uses.

    False for clang and for a compiler that does not run. The answer is cached by command. Raises
    MissingToolError.
    """
    return _has_gcc_vectors(tuple(find_compiler()))


@cache
def _has_gcc_vectors(command: tuple[str, ...]) -> bool:
    """Tell the same of a compiler command, from its predefined macros; False if it does not run."""
    query = [*command, "-dM", "-E", "-x", "c", "-"]
    try:
        result = subprocess.run(query, input="", capture_output=True, text=True, timeout=TIMEOUT)
    except (OSError, subprocess.TimeoutExpired):
        return False
    macros = {line.split()[1] for line in result.stdout.splitlines() if line.startswith("#define ")}
    return {"__GNUC__", "__x86_64__"} <= macros and "__clang__" not in macros
