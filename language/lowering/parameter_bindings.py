"""Parameter: what a Program reads of parameters - groups, kinds, order, tunables, units."""

from __future__ import annotations

from collections.abc import Iterable

from language.expressions.units import Unit
from language.ir.number_type import round_to_type
from language.ir.ops import Expr, Ref, Value
from language.ir.program import TICK_UNIT, Constant, value_type
from language.lowering.expressions import WHOLE_TYPES, names_read
from language.lowering.wait_ticks import tunable_waits, wait_range_in_ticks
from language.model.analysis_cache import cache_on_owner
from language.model.automaton import Automaton
from language.model.declaration import Formula
from language.model.graphs import post_order
from language.typecheck.types import TypeName


@cache_on_owner
def constant_bindings(automaton: Automaton) -> dict[str, Expr]:
    """Return the parameters, and the names of enumerations, as what a Program reads."""
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
    """Return each parameter's kind: what is derived from fixed values alone is fixed."""
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
    """Return the parameters so that each comes after those that it is derived from."""
    parameters = automaton.parameters.items()
    return post_order({name: p.derived.reads if p.derived else () for name, p in parameters})


def tunables_of(automaton: Automaton, formulas: Iterable[Formula]) -> tuple[str, ...]:
    """Return the tunable parameters that some formulas read, directly or through derived ones."""
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
    """Return the Program's constant for a parameter."""
    parameter = automaton.parameters[name]
    groups = {"fixed": "constant", "tunable": "calibration", "derived": "derived"}
    is_wait = name in tunable_waits(automaton)
    limits = wait_range_in_ticks(automaton, parameter) if is_wait else parameter.range
    kept: TypeName = "int" if is_wait else parameter.type
    return Constant(
        name=f"{groups[kind]}.{name}",
        kind=kind,  # type: ignore[arg-type]
        value=cast_to_type(value, kept),
        unit=TICK_UNIT if is_wait else si_unit_text(automaton, name),
        key=f"{declaring_automaton(automaton, name)} {parameter.key}",
        range=(round_to_type(limits[0]), round_to_type(limits[1])) if limits else None,
        type=value_type(kept),
        values=parameter.values,
        items=tuple(round_to_type(item) for item in parameter.table.values)
        if parameter.table
        else (),
        about=parameter.about,
    )


def cast_to_type(value: float, kind: TypeName) -> float | int | bool:
    """Return a number as a value of a type."""
    if kind == "real":
        return value
    return bool(value) if kind == "bool" else int(value)


def declaring_automaton(automaton: Automaton, name: str) -> str:
    """Return the automaton that declares a parameter: the model, or this one."""
    model = automaton.model
    return model.name if model and name in model.parameters else automaton.name


def si_unit_text(automaton: Automaton, name: str) -> str:
    """Return the SI unit of a name, for comments: the unit as written where it is SI."""
    unit = _unit_of(automaton, name)
    if unit and unit.factor == 1 and not unit.offset:
        return unit.text
    dimension = unit.dimension if unit else automaton.dimensions.get(name)
    return str(dimension) if dimension else "1"


def _unit_of(automaton: Automaton, name: str) -> Unit | None:
    if name in automaton.parameters:
        return automaton.parameters[name].unit
    if name in automaton.inputs:
        return automaton.inputs[name].unit
    return automaton.state_variables[name].unit if name in automaton.state_variables else None
