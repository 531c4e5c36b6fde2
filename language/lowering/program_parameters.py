"""Program parameters: groups, kinds, order of dependence, tunable parameters and units."""

from __future__ import annotations

from collections.abc import Iterable

from language.expressions.units import Unit
from language.ir.analysis_cache import cache_on_owner
from language.ir.number_type import round_to_type
from language.ir.ops import Expr, Ref, Value
from language.ir.program import TICK_UNIT, Constant, value_type
from language.lowering.expressions import WHOLE_TYPES, names_read
from language.lowering.wait_ticks import tunable_waits, wait_range_in_ticks
from language.model.automaton import Automaton
from language.model.declaration import Formula
from language.model.graph_algorithms import post_order
from language.typecheck.types import TypeName


@cache_on_owner
def constant_bindings(automaton: Automaton) -> dict[str, Expr]:
    """Return the Program's expressions of parameters, table axes and enumeration literals, by name.

    A parameter is `constant.<name>`, `calibration.<name>` or `derived.<name>`, by its kind
    (`parameter_kinds`); an enumeration literal is its number. A table adds the keys `<name> axis
    <k>` and `<name> size <k>`, k from 1. The dict is cached and not to be changed.
    """
    groups = {"fixed": "constant", "tunable": "calibration", "derived": "derived"}
    found: dict[str, Expr] = {name: Value(n) for name, n in automaton.enum_literals.items()}
    for name, kind in parameter_kinds(automaton).items():
        is_whole = automaton.parameters[name].type in WHOLE_TYPES
        found[name] = Ref(f"{groups[kind]}.{name}", is_whole)
    for name, parameter in automaton.parameters.items():
        for k, axis in enumerate(parameter.table.axes if parameter.table else (), start=1):
            found[f"{name} axis {k}"] = Ref(f"axis.{name}_{k}")
            found[f"{name} size {k}"] = Value(len(axis.points))
    return found


@cache_on_owner
def parameter_kinds(automaton: Automaton) -> dict[str, str]:
    """Return the kind of each parameter, in the order of the file: fixed, tunable or derived.

    A parameter that is derived from fixed ones only is fixed; one that reads a tunable, directly or
    indirectly, is derived.
    """
    kinds: dict[str, str] = {}
    for name in parameter_order(automaton):
        parameter = automaton.parameters[name]
        kinds[name] = parameter.kind
        if parameter.derived:
            reads = {kinds.get(read, "derived") for read in parameter.derived.reads}
            kinds[name] = "fixed" if reads <= {"fixed"} else "derived"
    return {name: kinds[name] for name in automaton.parameters}


@cache_on_owner
def parameter_order(automaton: Automaton) -> list[str]:
    """Return the names of all parameters, each after those that it is derived from."""
    parameters = automaton.parameters.items()
    return post_order({name: p.derived.reads if p.derived else () for name, p in parameters})


def tunables_of(automaton: Automaton, formulas: Iterable[Formula]) -> tuple[str, ...]:
    """Return the tunable parameters that formulas read, sorted by name, each once.

    Parameters that are read through derived ones count too; equations are not followed.
    """
    found: dict[str, None] = {}
    stack = names_read(formula.tree for formula in formulas)
    seen: set[str] = set()
    while stack:
        name = stack.pop()
        parameter = automaton.parameters.get(name)
        if parameter is None or name in seen:
            continue
        seen.add(name)
        if parameter.kind == "tunable":
            found[name] = None
        if parameter.derived:
            stack.extend(parameter.derived.reads)
    return tuple(sorted(found))


def constant_of(automaton: Automaton, name: str, kind: str, value: float) -> Constant:
    """Return the constant of a parameter, with unit, range, key path and table values.

    `kind` is fixed, tunable or derived and gives the group of the name. `value` is converted to the
    type of the parameter. A tunable wait is a whole number of ticks, and its range is in ticks.
    """
    parameter = automaton.parameters[name]
    groups = {"fixed": "constant", "tunable": "calibration", "derived": "derived"}
    is_wait = name in tunable_waits(automaton)
    limits = wait_range_in_ticks(automaton, parameter) if is_wait else parameter.range
    kind_of_value: TypeName = "int" if is_wait else parameter.type
    return Constant(
        name=f"{groups[kind]}.{name}",
        kind=kind,  # type: ignore[arg-type]
        value=cast_to_type(value, kind_of_value),
        unit=TICK_UNIT if is_wait else si_unit_text(automaton, name),
        key=f"{declaring_automaton(automaton, name)} {parameter.key}",
        range=(round_to_type(limits[0]), round_to_type(limits[1])) if limits else None,
        type=value_type(kind_of_value),
        values=parameter.values,
        items=tuple(round_to_type(item) for item in parameter.table.values)
        if parameter.table
        else (),
        about=parameter.about,
    )


def cast_to_type(value: float, kind: TypeName) -> float | int | bool:
    """Return a number in the Python type of a model type.

    `bool` gives a bool, `int` and `enum` an int (a fraction is truncated); `real` is unchanged.
    """
    if kind == "real":
        return value
    return bool(value) if kind == "bool" else int(value)


def declaring_automaton(automaton: Automaton, name: str) -> str:
    """Return the name of the automaton that declares a parameter.

    It is the model if that has a parameter of this name, else this automaton.
    """
    model = automaton.model
    return model.name if model and name in model.parameters else automaton.name


def si_unit_text(automaton: Automaton, name: str) -> str:
    """Return the SI unit of a name for comments.

    It is the text of the declared unit if that has the factor 1 and no offset, else the text of the
    dimension; `1` for a name without either. A name without a declared unit is looked up in the
    dimensions of the automaton.
    """
    unit = _unit_of(automaton, name)
    if unit and unit.factor == 1 and not unit.offset:
        return unit.text
    dimension = unit.dimension if unit else automaton.dimensions.get(name)
    return str(dimension) if dimension else "1"


def _unit_of(automaton: Automaton, name: str) -> Unit | None:
    """Return the unit of a parameter, input, state or discrete variable; None for other names."""
    if name in automaton.parameters:
        return automaton.parameters[name].unit
    if name in automaton.inputs:
        return automaton.inputs[name].unit
    return automaton.state_variables[name].unit if name in automaton.state_variables else None
