"""FMU interface: the variables and enumeration types of a Program's FMU."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from codegen.emit.c_names import CNames, c_member, c_type, enumerations
from codegen.exchange.fmi.unit import SECOND, unit_name
from codegen.exchange.fmi.variable import (
    TYPE_LIMITS,
    Causality,
    FmuVariable,
    Version,
    fmi_enumeration_type,
    fmi_type,
)
from codegen.passes.step_restriction import restrict_to_step
from language.ir.number_type import shortest_decimal
from language.ir.ops import Assign, Value
from language.ir.program import (
    MODE_VARIABLE,
    TICK_UNIT,
    Constant,
    ModeInfo,
    Program,
    Variable,
    mode_variable,
    unqualified_name,
)
from language.text.sanitise import escape_invisible

RUN_MODE = "memory.run_mode"
"""The variable of the mode of the model that a run integrates."""

TYPE_PREFIX = "type."
"""The prefix of type names, which in FMI must differ from names of variables."""


@dataclass(frozen=True)
class Enumeration:
    """An enumeration type: its name, and pairs of item name and number.

    Numbers may begin at any value.
    """

    name: str
    items: tuple[tuple[str, int], ...]


def enumerations_of(program: Program) -> tuple[Enumeration, ...]:
    """Return the enumeration types of a Program.

    These are, in this order, `type.mode`, `type.region.<region>` for each region, `type.run_mode`
    if there are run modes, and `type.values.<owner>` for each list of `enumerations`.
    """
    types = [_mode_enumeration("mode", program.modes)]
    types += [_mode_enumeration(f"region.{info.name}", info.modes) for info in program.regions]
    if program.run_modes:
        types.append(_mode_enumeration("run_mode", program.run_modes))
    types += [
        Enumeration(
            f"{TYPE_PREFIX}values.{name}", tuple((value, k) for k, value in enumerate(values))
        )
        for name, values in enumerations(program)
    ]
    return tuple(types)


def enumeration_name(program: Program, name: str, values: tuple[str, ...] = ()) -> str:
    """Return the name of the enumeration type of a variable or constant; empty if it has none.

    It is that of the mode variable, the run mode or a region's mode if `name` is one of them,
    whatever `values` is. Otherwise it is `type.values.<owner>`, where the owner is the first
    constant or variable with the same `values`; StopIteration if there is none. It is empty without
    `values`.
    """
    if name == MODE_VARIABLE:
        return f"{TYPE_PREFIX}mode"
    if name == RUN_MODE:
        return f"{TYPE_PREFIX}run_mode"
    for region in program.regions:
        if name == mode_variable(MODE_VARIABLE, region.name):
            return f"{TYPE_PREFIX}region.{region.name}"
    owners = (owner for owner, known in enumerations(program) if known == values)
    return f"{TYPE_PREFIX}values.{next(owners)}" if values else ""


def _mode_enumeration(name: str, modes: Iterable[ModeInfo]) -> Enumeration:
    """Return the enumeration type of a list of modes."""
    return Enumeration(f"{TYPE_PREFIX}{name}", tuple((mode.name, mode.number) for mode in modes))


LOCAL_PREFIXES = (
    "state.",
    "discrete.",
    "equation.",
    "innovation.",
    "memory.mode",
    "memory.run_mode",
)
"""Prefixes of variables of the instance that become locals of the FMU unless an output shows
them.
"""

FIRED_PREFIX = "memory.fired"
"""The prefix of variables with the number of the last transition; they become locals too."""

FAULT_WORD = "memory.faults"
"""The fault word, which becomes a local too."""


def variables_of(program: Program, version: Version) -> tuple[FmuVariable, ...]:
    """Return the variables of an FMU: time, inputs, parameters, outputs, locals, faults.

    Names are those of the spec; an element of a table is `<name>[k]` with k from 1. Locals are
    scalars of the instance (LOCAL_PREFIXES, last transitions, the fault word) that are no source of
    an output. A name that occurs again gets its causality and a dot as a prefix.
    """
    program = restrict_to_step(program)
    variables = [
        _time_variable(version),
        *_input_variables(program, version),
        *_parameter_variables(program, version),
        *_output_variables(program, version),
        *_local_variables(program, version),
        *_fault_variables(program),
    ]
    return tuple(_make_names_unique(variables))


def _time_variable(version: Version) -> FmuVariable:
    """Return the independent variable."""
    kind = fmi_type(version, "double")
    return FmuVariable("time", kind, "double", "time", "independent", "continuous", unit=SECOND)


def _input_variables(program: Program, version: Version) -> Iterator[FmuVariable]:
    """Yield the inputs and the flags for new values, with start values and limits."""
    place, first = CNames(program), _start_values(program)
    for variable in program.variables:
        group, _, name = variable.name.partition(".")
        if group not in ("input", "is_new"):
            continue
        storage_type = c_type(variable, program.number_type)
        is_new = group == "is_new"
        made = _make_variable(
            program,
            version,
            variable,
            storage_type,
            place(variable.name).replace("in->", "in."),
            "input",
        )
        start = True if is_new else first.get(name, 0)
        yield dataclasses.replace(
            _with_limits(made, program, None),
            name=f"is_new.{name}" if is_new else name,
            start=_format_value(start, storage_type, program),
        )


def _start_values(program: Program) -> dict[str, float | bool]:
    """Return the start values of inputs: the default, else the value that `init` sets.

    `init` sets the value of the range that is nearest to 0.
    """
    held = {
        unqualified_name(op.target): op.value.value
        for op in program.blocks.get("init", ())
        if isinstance(op, Assign) and isinstance(op.value, Value)
        if op.target.startswith("latched.")
    }
    return {**held, **program.defaults}


def _parameter_variables(program: Program, version: Version) -> Iterator[FmuVariable]:
    """Yield the calibration page as parameters: tunables, tables by point, and solved numbers."""
    for constant in program.constants:
        if constant.kind not in ("tunable", "solved"):
            continue
        group = "cal.solved." if constant.kind == "solved" else "cal."
        name = ("solved." if constant.kind == "solved" else "") + unqualified_name(constant.name)
        variable = Variable(constant.name, constant.type, constant.unit, values=constant.values)
        storage_type, member = c_type(constant, program.number_type), c_member(constant.name)
        made = _make_variable(program, version, variable, storage_type, group + member, "parameter")
        made = dataclasses.replace(_with_limits(made, program, constant), name=name)
        about = constant.about or constant.key
        if constant.unit == TICK_UNIT and program.period:
            about += f"; in ticks of {shortest_decimal(float(program.period), 'float64')} s"
        if not constant.items:
            start = _format_value(constant.value, storage_type, program)
            yield dataclasses.replace(made, start=start, about=escape_invisible(about))
        for k, item in enumerate(constant.items):
            yield dataclasses.replace(
                made,
                name=f"{name}[{k + 1}]",
                place=f"{made.place}[{k}]",
                start=_format_value(item, storage_type, program),
                about=escape_invisible(about),
            )


def _output_variables(program: Program, version: Version) -> Iterator[FmuVariable]:
    """Yield the outputs."""
    sources = {variable.name: variable for variable in program.variables}
    for wire in program.outputs:
        source = dataclasses.replace(sources[wire.source], unit=wire.unit)
        storage_type = c_type(source, program.number_type)
        made = _make_variable(program, version, source, storage_type, f"out.{wire.name}", "output")
        yield dataclasses.replace(made, name=wire.name)


def _local_variables(program: Program, version: Version) -> Iterator[FmuVariable]:
    """Yield variables of the instance that no output shows, as locals."""
    place = CNames(program)
    output_sources = {wire.source for wire in program.outputs}
    for variable in program.variables:
        name = variable.name
        is_local = name.startswith((*LOCAL_PREFIXES, FIRED_PREFIX)) or name == FAULT_WORD
        if not is_local or name in output_sources or variable.size:
            continue
        storage_type = c_type(variable, program.number_type)
        where = place(name).replace("self->", "self.")
        made = _make_variable(program, version, variable, storage_type, where, "local")
        yield dataclasses.replace(made, name=name.removeprefix("memory."))


def _fault_variables(program: Program) -> Iterator[FmuVariable]:
    """Yield one boolean local for each fault bit."""
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


def _make_variable(
    program: Program,
    version: Version,
    variable: Variable,
    storage_type: str,
    place: str,
    causality: Causality,
) -> FmuVariable:
    """Return an FMU variable whose type, variability, unit and comment follow from a variable.

    `place` is its path in C, `storage_type` its C type.
    """
    declared = enumeration_name(program, variable.name, variable.values)
    flows = program.period is None and variable.type == "real"
    variability = "continuous" if flows else "discrete"
    return FmuVariable(
        name=unqualified_name(variable.name),
        type=fmi_enumeration_type(version) if declared else fmi_type(version, storage_type),
        kept=storage_type,
        place=place,
        causality=causality,
        variability="tunable" if causality == "parameter" else variability,
        unit=unit_name(variable.unit) if variable.type == "real" else "",
        declared=declared,
        about=escape_invisible(variable.about),
    )


def _with_limits(variable: FmuVariable, program: Program, constant: Constant | None) -> FmuVariable:
    """Return a settable variable with the limits of its values.

    The limits are those of the range of a parameter, of the enumeration, or of the C type.
    """
    low, high = TYPE_LIMITS[variable.kept]
    if variable.declared:
        items = next(e.items for e in enumerations_of(program) if e.name == variable.declared)
        low, high = (f"{number}.0" for number in (items[0][1], items[-1][1]))
    if constant is None or constant.range is None:
        return dataclasses.replace(variable, low=low, high=high)
    ends = [float(end) for end in constant.range]
    range_texts = (
        _format_value(ends[0], variable.kept, program),
        _format_value(ends[1], variable.kept, program),
    )
    # The C compares doubles: the end of a float32 range needs all digits of a double.
    return dataclasses.replace(variable, range=range_texts, low=repr(ends[0]), high=repr(ends[1]))


def _format_value(value: float | bool, storage_type: str, program: Program) -> str:
    """Return a value as text in the model description."""
    if storage_type == "bool":
        return "true" if value else "false"
    if storage_type in ("double", "float"):
        return shortest_decimal(float(value), program.number_type)
    return str(int(value))


def _make_names_unique(variables: Sequence[FmuVariable]) -> Iterator[FmuVariable]:
    """Yield the variables; a name that occurred before gets its causality as a prefix."""
    taken: set[str] = set()
    for variable in variables:
        name = variable.name
        while name in taken:
            name = f"{variable.causality}.{name}"
        taken.add(name)
        yield dataclasses.replace(variable, name=name)


def used_enumerations(
    program: Program, variables: Sequence[FmuVariable]
) -> tuple[Enumeration, ...]:
    """Return the types of `enumerations_of` that a variable has as `declared`, in that order."""
    declared = {variable.declared for variable in variables}
    return tuple(one for one in enumerations_of(program) if one.name in declared)
