"""Build: generated C compiled with the flags under which its bits are defined (rule R7)."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from codegen.cache import key_of, stored
from codegen.names import REAL, CNames, c_member, c_type
from codegen.rendering import render
from codegen.source import c_files, stepped
from language.missing import ToolMissing as ToolMissing
from language.program import Constant, Program, Variable

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-fast-math", "-fno-math-errno")
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
SECONDS = 120
"""Longest compilation or run before it is given up."""


class BuildError(Exception):
    """Generated code does not compile or run: a defect of ours; the message is the compiler's."""


@dataclass(frozen=True)
class Observed:
    """A variable that the executable writes after each tick: its name and its kind."""

    name: str
    kind: str


def compiler(named: str | None = None) -> list[str]:
    """Return the C compiler: the one named, else `CC`, else cc, gcc, clang. Raises ToolMissing."""
    wanted = shlex.split(named or os.environ.get("CC", ""))
    for candidate in [wanted] if wanted else [["cc"], ["gcc"], ["clang"]]:
        if shutil.which(candidate[0]):
            return candidate
    name = wanted[0] if wanted else "cc"
    raise ToolMissing(f"the C compiler `{name}` is missing: apt-get install gcc libc6-dev")


def optimised(level: str) -> tuple[str, ...]:
    """Return the flags with another level of optimisation, like `O3`."""
    return tuple(f"-{level}" if flag == "-O2" else flag for flag in FLAGS)


def compiler_version(named: str | None = None) -> str:
    """Return where the compiler is and the first line that it says of itself. Raises BuildError."""
    command = compiler(named)
    try:
        done = subprocess.run(
            [*command, "--version"], capture_output=True, text=True, timeout=SECONDS, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise BuildError(f"the C compiler `{command[0]}` does not run: {error}") from None
    first = (done.stdout or done.stderr).strip().split("\n")[0]
    return f"{os.path.realpath(shutil.which(command[0]) or command[0])}: {first}"


def observed(program: Program) -> tuple[Observed, ...]:
    """Return what is compared after a tick: all that the instance carries in C.

    What is in a ring is compared when it comes out of it.
    """
    program = stepped(program)
    kinds = {"real": "real", "truth": "whole", "whole": "whole"}
    return tuple(
        Observed(variable.name, kinds[variable.type])
        for variable in program.variables
        if variable.name.partition(".")[0] not in ("work", "input", "is_new", "check")
        and not variable.size
    )


def fed(program: Program) -> tuple[Variable, ...]:
    """Return the inputs of a tick, the flags of new values among them."""
    return tuple(
        variable
        for variable in program.variables
        if variable.name.partition(".")[0] in ("input", "is_new")
    )


def tunable(program: Program) -> tuple[Constant, ...]:
    """Return the parameters that a calibration page may change, in the order of its members."""
    program = stepped(program)
    return tuple(
        constant
        for constant in program.constants
        if constant.kind == "tunable" and constant.type == "real" and not constant.items
    )


def write_harness(program: Program, folder: Path) -> list[Path]:
    """Write the C files of a program and a main around them; return the sources to compile."""
    files = c_files(program)
    files["main.c"] = render("lockstep_main.c.jinja", _harness(program))
    for name, text in files.items():
        (folder / name).write_text(text)
    return [folder / name for name in files if name.endswith(".c")]


def compile_program(
    sources: Sequence[Path],
    target: Path,
    flags: Sequence[str] = FLAGS,
    named: str | None = None,
) -> None:
    """Compile sources into an executable. Raises ToolMissing, BuildError."""
    command = [*compiler(named), *flags, *WARNINGS, *map(str, sources)]
    try:
        done = subprocess.run(
            [*command, "-lm", "-o", str(target)], capture_output=True, text=True, timeout=SECONDS
        )
    except subprocess.TimeoutExpired:
        raise BuildError(f"the compiler was not done after {SECONDS} s") from None
    if done.returncode != 0:
        raise BuildError(_first_error(done.stderr) or f"the compiler ended with {done.returncode}")


@contextmanager
def executable(
    program: Program, flags: Sequence[str] = FLAGS, named: str | None = None
) -> Iterator[Path]:
    """Give the compiled harness of a program, kept from an earlier run if there was one."""
    with tempfile.TemporaryDirectory(prefix="modewright-") as name:
        folder = Path(name)
        sources = write_harness(program, folder)
        key = key_of(sources, [*compiler(named), *flags, *WARNINGS], compiler_version(named))
        yield stored(key, lambda target: compile_program(sources, target, flags, named), folder)


def run_executable(target: Path, records: bytes) -> bytes:
    """Run a harness on input records and return its output records. Raises BuildError."""
    try:
        done = subprocess.run([str(target)], input=records, capture_output=True, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        raise BuildError(f"the compiled program was not done after {SECONDS} s") from None
    if done.returncode != 0:
        raise BuildError(f"the compiled program ended with {done.returncode}")
    return done.stdout


def _first_error(text: str) -> str:
    """Return what a compiler said, from its first error on."""
    lines = text.strip().splitlines()
    first = next((k for k, line in enumerate(lines) if "error:" in line), 0)
    return "\n".join(lines[first:])


def _harness(program: Program) -> Mapping[str, object]:
    program = stepped(program)
    place, real = CNames(program), REAL[program.number]
    inputs = [
        {"place": place(v.name).replace("in->", "in."), "type": c_type(v, program.number)}
        for v in fed(program)
    ]
    fields = [
        {
            "place": place(o.name).replace("self->", "self."),
            "type": real if o.kind == "real" else "int64_t",
        }
        for o in observed(program)
    ]
    return {
        "name": program.name,
        "cast": ("uint8_t", "int32_t", "float"),
        "inputs": inputs,
        "fields": fields,
        "page": [c_member(constant.name) for constant in tunable(program)],
        "real": real,
    }
