"""Harness: a main function around the C of a Program that reads input records and writes values."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from codegen.emit.c_module import emit_c_files
from codegen.emit.c_names import C_REAL_TYPE, CNames, c_member, c_type
from codegen.passes.step_restriction import restrict_to_step
from codegen.toolchain.build_cache import get_or_build, key_of
from codegen.toolchain.compiler import FLAGS, WARNINGS, compiler_version, run_compiler
from codegen.toolchain.object_cache import substitute_objects
from codegen.toolchain.target_machine import HOST, Machine, harness_file
from codegen.toolchain.templates import render
from language.ir.program import Constant, Program, Variable
from language.text.temporary_files import temporary_folder

HARNESS_HEADERS = ("harness.h", "cortex_m4f.h")
"""Headers of the harness that every main needs."""


@dataclass(frozen=True)
class HarnessMain:
    """A main function: its template, and files of the harness that only it needs."""

    template: str
    files: tuple[str, ...] = ()


LOCKSTEP_MAIN = HarnessMain("harness/lockstep_main.c.jinja")
"""The main that writes all compared variables after each tick."""


@dataclass(frozen=True)
class ComparedVariable:
    """A variable that the executable writes after each tick; `kind` is `real` or `whole`."""

    name: str
    kind: str


def compared_variables(program: Program) -> tuple[ComparedVariable, ...]:
    """Return the variables of the instance that are compared after each tick, in Program order.

    Left out are arrays (the values of a ring buffer are compared when they are read from it) and
    the groups `work`, `input`, `is_new` and `check`. `kind` is `real`, or `whole` for all others.
    """
    program = restrict_to_step(program)
    kinds = {"real": "real", "truth": "whole", "whole": "whole"}
    return tuple(
        ComparedVariable(variable.name, kinds[variable.type])
        for variable in program.variables
        if variable.name.partition(".")[0] not in ("work", "input", "is_new", "check")
        and not variable.size
    )


def tick_inputs(program: Program) -> tuple[Variable, ...]:
    """Return the variables of the groups `input` and `is_new`, in Program order.

    The latter are flags for new values.
    """
    return tuple(
        variable
        for variable in program.variables
        if variable.name.partition(".")[0] in ("input", "is_new")
    )


def tunable_constants(program: Program) -> tuple[Constant, ...]:
    """Return the tunable parameters that are real scalars, in Program order.

    Those that the C does not use (`restrict_to_step`) are left out.
    """
    program = restrict_to_step(program)
    return tuple(
        constant
        for constant in program.constants
        if constant.kind == "tunable" and constant.type == "real" and not constant.items
    )


def write_harness(
    program: Program,
    folder: Path,
    machine: Machine = HOST,
    main: HarnessMain = LOCKSTEP_MAIN,
    extra_context: Mapping[str, object] | None = None,
) -> list[Path]:
    """Write the C files of a Program and a main around them; return the C files to compile.

    Files of the harness are in a subfolder `harness`. `machine` adds its own files to those of
    `main`. `extra_context` extends the context of the template of `main`, and wins over it. Raises
    ValueError for a Program without a block `step`.
    """
    (folder / "harness").mkdir(exist_ok=True)
    own = (*machine.files, *main.files)
    for name in (*HARNESS_HEADERS, *own):
        shutil.copyfile(harness_file(name), folder / "harness" / name)
    files = emit_c_files(program)
    files["main.c"] = render(main.template, {**_main_context(program), **(extra_context or {})})
    for name, text in files.items():
        (folder / name).write_text(text)
    names = (*files, *(f"harness/{name}" for name in own))
    return [folder / name for name in names if name.endswith(".c")]


@contextmanager
def build_executable(
    program: Program,
    flags: Sequence[str] = FLAGS,
    compiler_name: str | None = None,
    machine: Machine = HOST,
    main: HarnessMain = LOCKSTEP_MAIN,
) -> Iterator[Path]:
    """Yield the path of the compiled harness of a Program, from the cache if it was built before.

    If the cache cannot be used, the path is in a temporary folder that is removed at the end.
    Raises MissingToolError, BuildError.
    """
    with temporary_folder() as folder:
        sources = write_harness(program, folder, machine, main)
        command, link = machine.command(compiler_name), machine.link(folder / "harness")
        version = compiler_version(command[0])
        compile_command = [*command, *flags, *WARNINGS]
        key = key_of(sources, [*compile_command, *machine.link(Path())], version)

        def make(target: Path) -> None:
            parts = substitute_objects(sources, compile_command, version, folder / "objects")
            run_compiler([*compile_command, *map(str, parts), *link], target)

        yield get_or_build(key, make, folder)


def _main_context(program: Program) -> Mapping[str, object]:
    """Return the template context of a main: inputs, tunable parameters and compared variables."""
    program = restrict_to_step(program)
    c_names, real = CNames(program), C_REAL_TYPE[program.number_type]
    inputs = [
        {"place": c_names(v.name).replace("in->", "in."), "type": c_type(v, program.number_type)}
        for v in tick_inputs(program)
    ]
    fields = [
        {
            "place": c_names(o.name).replace("self->", "self."),
            "type": real if o.kind == "real" else "int64_t",
        }
        for o in compared_variables(program)
    ]
    return {
        "name": program.name,
        "cast": ("uint8_t", "int32_t", "float"),
        "inputs": inputs,
        "fields": fields,
        "page": [c_member(constant.name) for constant in tunable_constants(program)],
        "real": real,
    }
