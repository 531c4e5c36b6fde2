"""Compiler: compiles generated C with the flags that define its bits (rules C3 and C24)."""

from __future__ import annotations

import ctypes
import errno
import itertools
import os
import shlex
import shutil
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path
from typing import TypedDict

from language.text.diagnostic import BrokenToolError, MissingToolError
from language.text.temporary_files import temporary_folder

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-fast-math", "-fno-math-errno")
"""The flags that define the bits of results."""
OPTIMISATION_LEVELS = ("O0", "O1", "O2", "O3", "Os")
"""Levels that keep the bits of results, without `-`."""

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


class TextOptions(TypedDict):
    """Options of `subprocess` for output as text."""

    encoding: str
    errors: str


TIMEOUT = 120
"""Time limit of a compilation or a run [s]."""
AS_TEXT: TextOptions = {"encoding": "utf-8", "errors": "replace"}
"""Options of a process whose output is text; bytes that are not UTF-8 are replaced."""


class BuildError(Exception):
    """Generated code does not compile or run, which is a defect of the product.

    The message is that of the compiler or of the program.
    """


TRIAL_SOURCE = "int main(void)\n{\n    return 0;\n}\n"
"""A program that each C compiler compiles; one that does not is broken."""


@contextmanager
def convert_process_errors(
    name: str, timeout_error: type[Exception] = BrokenToolError
) -> Iterator[None]:
    """Return a context that raises an error for a process that does not start or end in time.

    `name` is the subject of the message, like "the compiler". An OSError becomes BrokenToolError,
    subprocess.TimeoutExpired becomes `timeout_error`; other exceptions leave the context unchanged.
    """
    try:
        yield
    except subprocess.TimeoutExpired as error:
        raise timeout_error(f"{name} was not done after {error.timeout:g} s") from None
    except OSError as error:
        raise BrokenToolError(f"{name} does not run: {error}") from None


@contextmanager
def scratch_environment() -> Iterator[dict[str, str]]:
    """Return a context with the environment of a process that may be killed.

    Its TMPDIR is a folder that is removed at the end, with the temporary files that a killed
    process leaves.
    """
    with temporary_folder() as folder:
        yield {**os.environ, "TMPDIR": str(folder)}


def find_compiler(name: str | None = None) -> list[str]:
    """Return the command of the C compiler: `name`, else $CC, else the first of cc, gcc and clang.

    `name` and $CC are split into words like a shell command. Raises MissingToolError if the first
    word is not an installed program, and BrokenToolError if the text is no shell command.
    """
    text = name or os.environ.get("CC", "")
    try:
        requested = shlex.split(text)
    except ValueError as error:
        raise BrokenToolError(
            f"the C compiler `{text}` is no command: {error}; set CC to a command like `gcc`"
        ) from None
    for candidate in [requested] if requested else [["cc"], ["gcc"], ["clang"]]:
        if shutil.which(candidate[0]):
            return candidate
    executable = requested[0] if requested else "cc"
    raise MissingToolError(
        f"the C compiler `{executable}` is missing: apt-get install gcc libc6-dev"
    )


def flags_at_level(level: str) -> tuple[str, ...]:
    """Return FLAGS with another of OPTIMISATION_LEVELS instead of -O2, for example `O3`."""
    return tuple(f"-{level}" if flag == "-O2" else flag for flag in FLAGS)


def compiler_version(name: str | None = None) -> str:
    """Return `path: line`: the resolved path of the compiler, the first line of its version text.

    The exit code is ignored. `name` is that of `find_compiler`. Raises MissingToolError;
    BrokenToolError if it cannot be started or does not end in TIMEOUT seconds.
    """
    command = find_compiler(name)
    with convert_process_errors(f"the C compiler `{command[0]}`"):
        done = subprocess.run(
            [*command, "--version"], capture_output=True, timeout=TIMEOUT, check=False, **AS_TEXT
        )
    first = (done.stdout or done.stderr).strip().split("\n")[0]
    return f"{os.path.realpath(shutil.which(command[0]) or command[0])}: {first}"


def compile_program(sources: Sequence[Path], target: Path, flags: Sequence[str] = FLAGS) -> None:
    """Compile sources with WARNINGS into an executable or a library, according to `flags`.

    Warnings are no errors. Raises MissingToolError, BuildError.
    """
    run_compiler([*find_compiler(), *flags, *WARNINGS, *map(str, sources), "-lm"], target)


def run_compiler(command: Sequence[str], target: Path) -> None:
    """Run a compiler command with `-o target` appended.

    Raises BuildError for a nonzero exit code, with its output from the first error on. Raises
    BrokenToolError for a compiler that does not compile TRIAL_SOURCE either, does not start, makes
    no file, has no space for its files, or is not done after TIMEOUT seconds. Warnings are dropped.
    """
    run_compilers([(command, target)])


def run_compilers(commands: Sequence[tuple[Sequence[str], Path]]) -> None:
    """Run compiler commands at the same time, each with `-o` and its target appended.

    Raises the errors of `run_compiler` for the first command of the sequence that fails; the other
    processes are killed. TIMEOUT counts for each process that is waited for.
    """
    with scratch_environment() as environment, ExitStack() as stack:
        running: list[subprocess.Popen[str]] = []
        for command, target in commands:
            with convert_process_errors("the compiler"):
                process = subprocess.Popen(
                    [*command, "-o", str(target)],
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.PIPE,
                    env=environment,
                    **AS_TEXT,
                )
            running.append(stack.enter_context(process))
            stack.callback(process.kill)
        for process, (command, target) in zip(running, commands, strict=True):
            with convert_process_errors("the compiler"):
                _, message = process.communicate(timeout=TIMEOUT)
            if process.returncode != 0:
                reason = _first_error(message) or f"it ended with {process.returncode}"
                if os.strerror(errno.ENOSPC) in message:
                    raise BrokenToolError(f"the compiler cannot write its files: {reason}")
                _require_working_compiler(command, environment)
                raise BuildError(reason)
            _require_output(command[0], target)


def _require_working_compiler(command: Sequence[str], environment: Mapping[str, str]) -> None:
    """Raise BrokenToolError if the compiler of a command does not compile TRIAL_SOURCE.

    The compiler consists of the words before the first option. The program is compiled, not linked,
    because a cross compiler needs more options to link.
    """
    compiler = list(itertools.takewhile(lambda word: not word.startswith("-"), command))
    with temporary_folder() as folder:
        source, target = folder / "trial.c", folder / "trial.o"
        source.write_text(TRIAL_SOURCE)
        with convert_process_errors(f"the C compiler `{compiler[0]}`"):
            done = subprocess.run(
                [*compiler, "-c", str(source), "-o", str(target)],
                stdin=subprocess.DEVNULL,
                capture_output=True,
                env=environment,
                timeout=TIMEOUT,
                check=False,
                **AS_TEXT,
            )
        if done.returncode:
            reason = _first_error(done.stderr) or f"it ended with {done.returncode}"
            raise BrokenToolError(
                f"the C compiler `{compiler[0]}` compiles no program: {reason}\n"
                "try another one: CC=gcc, or --compiler where a command has it"
            )
        _require_output(compiler[0], target)


def _require_output(compiler: str, target: Path) -> None:
    """Raise BrokenToolError if a compiler that ended without an error has written no file."""
    if not target.is_file() or not target.stat().st_size:
        raise BrokenToolError(
            f"the C compiler `{compiler}` ended without an error, but made no file"
        )


def load_shared_library(path: Path) -> ctypes.CDLL:
    """Load a compiled shared library. Raises BrokenToolError if the system does not load it."""
    try:
        return ctypes.CDLL(str(path))
    except OSError as error:
        raise BrokenToolError(f"what the C compiler made cannot be loaded: {error}") from None


def run_executable(
    target: Path, records: bytes, extra_environment: Mapping[str, str] | None = None
) -> bytes:
    """Run an executable with input records as its standard input; return its standard output.

    `extra_environment` is added to the environment. Raises BuildError for a nonzero exit code and
    after TIMEOUT seconds, and BrokenToolError if it does not start.
    """
    environment = {**os.environ, **(extra_environment or {})}
    with convert_process_errors("the compiled program", BuildError):
        done = subprocess.run(
            [str(target)], input=records, capture_output=True, env=environment, timeout=TIMEOUT
        )
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
        with convert_process_errors("the compiler"):
            result = subprocess.run(
                query, input="", capture_output=True, timeout=TIMEOUT, check=False, **AS_TEXT
            )
    except BrokenToolError:
        return False
    macros = {line.split()[1] for line in result.stdout.splitlines() if line.startswith("#define ")}
    return {"__GNUC__", "__x86_64__"} <= macros and "__clang__" not in macros
