"""Interface: the variables of a Program's FMU, in the order of their references."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

from codegen.fmi.enumeration import Enumeration, enumerations_of, type_of
from codegen.fmi.unit import SECOND, unit_name
from codegen.fmi.variable import (
    LIMITS,
    Causality,
    FmuVariable,
    Version,
    enumerated_in,
    type_in,
)
from codegen.names import CNames, c_member, c_type
from codegen.source import stepped
from language.number import decimal
from language.operation import Assign, Value
from language.program import TICKS, Constant, Program, Variable, short
from language.text import visible

LOCAL = ("state.", "discrete.", "equation.", "innovation.", "memory.mode", "memory.run_mode")
FIRED = "memory.fired"
FAULTS = "memory.faults"
"""Locals are what an instance carries of these, where no output has it."""


def variables_of(program: Program, version: Version) -> tuple[FmuVariable, ...]:
    """Return the variables of an FMU: time, inputs, parameters, outputs, locals.

    Names are those of the spec; a name that is taken gets its causality before it.
    """
    program = stepped(program)
    found = [
        _time(version),
        *_inputs(program, version),
        *_parameters(program, version),
        *_outputs(program, version),
        *_locals(program, version),
        *_faults(program, version),
    ]
    return tuple(_with_own_names(found))


def _time(version: Version) -> FmuVariable:
    kind = type_in(version, "double")
    return FmuVariable("time", kind, "double", "time", "independent", "continuous", unit=SECOND)


def _inputs(program: Program, version: Version) -> Iterator[FmuVariable]:
    place, first = CNames(program), _first_values(program)
    for variable in program.variables:
        group, _, name = variable.name.partition(".")
        if group not in ("input", "is_new"):
            continue
        kept = c_type(variable, program.number)
        is_new = group == "is_new"
        made = _variable(
            program, version, variable, kept, place(variable.name).replace("in->", "in."), "input"
        )
        start = True if is_new else first.get(name, 0)
        yield dataclasses.replace(
            _bounded(made, program, None),
            name=f"is_new.{name}" if is_new else name,
            start=_told(start, kept, program),
        )


def _first_values(program: Program) -> dict[str, float | bool]:
    """Return what inputs hold at first: their default, or of a range what is nearest to 0."""
    held = {
        short(op.target): op.value.value
        for op in program.blocks.get("init", ())
        if isinstance(op, Assign) and isinstance(op.value, Value)
        if op.target.startswith("latched.")
    }
    return {**held, **program.defaults}


def _parameters(program: Program, version: Version) -> Iterator[FmuVariable]:
    """The whole page: tunable parameters, tables by point, and numbers solved for them."""
    for constant in program.constants:
        if constant.kind not in ("tunable", "solved"):
            continue
        group = "cal.solved." if constant.kind == "solved" else "cal."
        name = ("solved." if constant.kind == "solved" else "") + short(constant.name)
        variable = Variable(constant.name, constant.type, constant.unit, values=constant.values)
        kept, member = c_type(variable, program.number), c_member(constant.name)
        made = _variable(program, version, variable, kept, group + member, "parameter")
        made = dataclasses.replace(_bounded(made, program, constant), name=name)
        about = constant.about or constant.key
        if constant.unit == TICKS and program.period:
            about += f"; in ticks of {decimal(float(program.period), 'float64')} s"
        if not constant.items:
            start = _told(constant.value, kept, program)
            yield dataclasses.replace(made, start=start, about=visible(about))
        for k, item in enumerate(constant.items):
            yield dataclasses.replace(
                made,
                name=f"{name}[{k + 1}]",
                place=f"{made.place}[{k}]",
                start=_told(item, kept, program),
                about=visible(about),
            )


def _outputs(program: Program, version: Version) -> Iterator[FmuVariable]:
    sources = {variable.name: variable for variable in program.variables}
    for wire in program.outputs:
        source = dataclasses.replace(sources[wire.source], unit=wire.unit)
        kept = c_type(source, program.number)
        made = _variable(program, version, source, kept, f"out.{wire.name}", "output")
        yield dataclasses.replace(made, name=wire.name)


def _locals(program: Program, version: Version) -> Iterator[FmuVariable]:
    place = CNames(program)
    told = {wire.source for wire in program.outputs}
    for variable in program.variables:
        name = variable.name
        is_local = name.startswith((*LOCAL, FIRED)) or name == FAULTS
        if not is_local or name in told or variable.size:
            continue
        kept = c_type(variable, program.number)
        where = place(name).replace("self->", "self.")
        made = _variable(program, version, variable, kept, where, "local")
        yield dataclasses.replace(made, name=name.removeprefix("memory."))


def _faults(program: Program, version: Version) -> Iterator[FmuVariable]:
    for bit, fault in enumerate(program.faults):
        yield FmuVariable(
            f"fault.{fault}",
            "Boolean",
            "fault",
            str(bit),
            "local",
            "discrete",
            about="set until a restart",
        )


def _variable(
    program: Program,
    version: Version,
    variable: Variable,
    kept: str,
    place: str,
    causality: Causality,
) -> FmuVariable:
    """Return a variable with what follows from its type."""
    declared = type_of(program, variable.name, variable.values)
    flows = program.period is None and variable.type == "real"
    variability = "continuous" if flows else "discrete"
    return FmuVariable(
        name=short(variable.name),
        type=enumerated_in(version) if declared else type_in(version, kept),
        kept=kept,
        place=place,
        causality=causality,
        variability="tunable" if causality == "parameter" else variability,
        unit=unit_name(variable.unit) if variable.type == "real" else "",
        declared=declared,
        about=visible(variable.about),
    )


def _bounded(made: FmuVariable, program: Program, constant: Constant | None) -> FmuVariable:
    """Return a variable that may be set with what it may be set to."""
    low, high = LIMITS[made.kept]
    if made.declared:
        items = next(e.items for e in enumerations_of(program) if e.name == made.declared)
        low, high = (f"{number}.0" for number in (items[0][1], items[-1][1]))
    if constant is None or constant.range is None:
        return dataclasses.replace(made, low=low, high=high)
    ends = [float(end) for end in constant.range]
    told = (_told(ends[0], made.kept, program), _told(ends[1], made.kept, program))
    # The C compares doubles: a float32 end is written with all its digits.
    return dataclasses.replace(made, range=told, low=repr(ends[0]), high=repr(ends[1]))


def _told(value: float | bool, kept: str, program: Program) -> str:
    """Return a value as the description has it."""
    if kept == "bool":
        return "true" if value else "false"
    if kept in ("double", "float"):
        return decimal(float(value), program.number)
    return str(int(value))


def _with_own_names(found: Sequence[FmuVariable]) -> Iterator[FmuVariable]:
    taken: set[str] = set()
    for variable in found:
        name = variable.name
        while name in taken:
            name = f"{variable.causality}.{name}"
        taken.add(name)
        yield dataclasses.replace(variable, name=name)


def used_enumerations(
    program: Program, variables: Sequence[FmuVariable]
) -> tuple[Enumeration, ...]:
    """Return the types that some variable has."""
    declared = {variable.declared for variable in variables}
    return tuple(one for one in enumerations_of(program) if one.name in declared)
