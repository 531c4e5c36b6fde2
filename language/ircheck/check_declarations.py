"""Checks of declarations: names, constants, modes, transitions, outputs and functions."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterable, Iterator

from language.ir.ops import Assign
from language.ir.program import Function, Program, ValueType
from language.ir.traversal import names_used
from language.ircheck.check_assignment import INPUT_PREFIXES
from language.ircheck.check_expression import ExpressionChecker
from language.ircheck.violation import Rule, Violation, operation_place

VARIABLE_GROUPS = frozenset(
    (
        *("before", "check", "discrete", "equation", "innovation", "input", "is_new", "latched"),
        *("memory", "signal", "state", "timer", "work"),
    )
)
"""Groups of variables (language/ir/program.py)."""
CONSTANT_GROUPS = frozenset(["axis", "calibration", "constant", "derived", "solved"])
"""Groups of constants."""
INTERFACE_GROUPS = ("input.", "is_new.", *INPUT_PREFIXES)
"""Prefixes of variables that stay although nothing reads them: callers set them."""
MAX_FAULTS = 32
"""Number of bits of the word of faults."""


def check_declarations(program: Program) -> Iterator[Violation]:
    """Yield the violations of the declarations of a Program, and of the bodies of its functions."""
    yield from _check_header(program)
    yield from _check_names(program)
    yield from _check_constants(program)
    yield from _check_modes(program)
    yield from _check_outputs(program)
    yield from _check_unused(program)
    for function in program.functions:
        yield from _check_function(program, function)


def _check_header(program: Program) -> Iterator[Violation]:
    """Yield the violations of the times and the faults."""
    if program.major_step <= 0 or (program.period is not None and program.period <= 0):
        yield Violation("range", "header", f"a step of {program.major_step} s is not positive")
    if len(program.faults) > MAX_FAULTS:
        yield Violation("range", "faults", f"{len(program.faults)} faults, at most {MAX_FAULTS}")
    yield from _check_unique("faults", program.faults)


def _check_unique(place: str, names: Iterable[object]) -> Iterator[Violation]:
    """Yield a violation for each name that occurs twice."""
    for name, count in Counter(names).items():
        if count > 1:
            yield Violation("declaration", place, f"`{name}` is declared {count} times")


def _check_names(program: Program) -> Iterator[Violation]:
    """Yield the violations of the names and properties of variables and constants."""
    variables, constants = program.variables, program.constants
    yield from _check_unique("names", [*(v.name for v in variables), *(c.name for c in constants)])
    groups = [(variable.name, VARIABLE_GROUPS) for variable in variables]
    groups += [(constant.name, CONSTANT_GROUPS) for constant in constants]
    for name, known in groups:
        group, _, rest = name.partition(".")
        if group not in known or not rest:
            message = f"`{name}` has no group of {', '.join(sorted(known))}"
            yield Violation("declaration", "names", message)
    for variable in variables:
        if variable.size < 0 or variable.largest < 1:
            yield Violation("range", f"variable {variable.name}", "a size or limit is too small")
        if variable.values and variable.type != "whole":
            message = f"an enumeration is whole, not {variable.type}"
            yield Violation("type", f"variable {variable.name}", message)
    ranges = [(variable.name, variable.range) for variable in variables]
    ranges += [(constant.name, constant.range) for constant in constants]
    for name, limits in ranges:
        if limits and not limits[0] <= limits[1]:
            message = f"the range {limits[0]!r} .. {limits[1]!r} is empty"
            yield Violation("range", f"declaration of {name}", message)
    inputs = {variable.name for variable in program.inputs}
    for name in program.defaults:
        if f"input.{name}" not in inputs:
            yield Violation("reference", "default inputs", f"there is no input `{name}`")


def _check_constants(program: Program) -> Iterator[Violation]:
    """Yield the violations of the values of constants and of what they depend on."""
    tunable = {c.name for c in program.constants if c.name.startswith("calibration.")}
    for constant in program.constants:
        place = f"constant {constant.name}"
        values = constant.items or (constant.value,)
        if any(math.isnan(value) for value in values):
            yield Violation("range", place, "the value is no number")
        if constant.type == "whole" and any(value != int(value) for value in values):
            yield Violation("type", place, f"{constant.value!r} is no whole number")
        if constant.range and not constant.items:
            low, high = constant.range
            if not low <= constant.value <= high:
                message = f"{constant.value!r} is outside of {low!r} .. {high!r}"
                yield Violation("range", place, message)
        for name in constant.depends_on:
            if f"calibration.{name}" not in tunable:
                yield Violation("reference", place, f"there is no tunable parameter `{name}`")


def _check_modes(program: Program) -> Iterator[Violation]:
    """Yield the violations of modes, transitions, alarms and invariants."""
    types = program.types()
    regions = program.mode_variables()
    yield from _check_unique("regions", [region.name for region in program.regions])
    for region in regions:
        yield from _check_unique(f"modes of {region}", [m.number for m in program.modes_of(region)])
    yield from _check_unique("transitions", [info.number for info in program.transitions])
    places = [(f"transition {t.name}", t.region, t.source) for t in program.transitions]
    places += [(f"transition {t.name}", t.region, t.target) for t in program.transitions]
    places += [(f"alarm {a.variable}", a.region, a.mode) for a in program.alarms]
    places += [(f"invariant {i.name}", i.region, i.mode) for i in program.invariants]
    for place, region, number in places:
        if region not in regions:
            yield Violation("reference", place, f"there is no region `{region}`")
        elif all(mode.number != number for mode in program.modes_of(region)):
            yield Violation("reference", place, f"region {region} has no mode {number}")
    for info in program.transitions:
        place = f"transition {info.name}"
        if info.ticks < 0 or info.wait < 0:
            yield Violation("range", place, f"a wait of {info.wait} s, {info.ticks} ticks")
        for name in (info.timer, info.tunable_wait):
            if name is not None:
                yield from check_declared(place, name, types)
    for alarm in program.alarms:
        yield from check_declared(f"alarm {alarm.variable}", alarm.variable, types)
    for invariant in program.invariants:
        place = f"invariant {invariant.name}"
        yield from check_declared(place, invariant.variable, types)
        if types.get(invariant.variable, "truth") != "truth":
            message = f"`{invariant.variable}` is {types[invariant.variable]}, not truth"
            yield Violation("type", place, message)


def check_declared(place: str, name: str, known: Collection[str]) -> Iterator[Violation]:
    """Yield a violation if a name is not declared."""
    if name not in known:
        yield Violation("reference", place, f"`{name}` is not declared")


def _check_outputs(program: Program) -> Iterator[Violation]:
    """Yield the violations of the outputs: their names, sources and types."""
    types = program.types()
    yield from _check_unique("outputs", [wire.name for wire in program.outputs])
    for wire in program.outputs:
        place = f"output {wire.name}"
        yield from check_declared(place, wire.source, types)
        kind = types.get(wire.source, wire.type)
        if kind != wire.type:
            message = f"it is {wire.type}, but `{wire.source}` is {kind}"
            yield Violation("type", place, message)


def _check_unused(program: Program) -> Iterator[Violation]:
    """Yield a violation for each variable that no block, output and invariant names."""
    used = names_used(program.blocks.values())
    used |= {wire.source for wire in program.outputs}
    used |= {invariant.variable for invariant in program.invariants}
    names = [v.name for v in program.variables if not v.name.startswith(INTERFACE_GROUPS)]
    for name in names:
        if name not in used:
            yield Violation("dead-store", "names", f"`{name}` is declared, but no block uses it")


def _check_function(program: Program, function: Function) -> Iterator[Violation]:
    """Yield the violations of the body of a function.

    It consists of assignments, its parameters are reals, each name is assigned before it is read,
    and the result `work.y` is a real.
    """
    place = f"function {function.name}"
    found: list[Violation] = []

    def report(rule: Rule, message: str) -> None:
        """Add a violation of the current operation."""
        found.append(Violation(rule, operation_place(f"of {place}", op), message))

    parameters: dict[str, ValueType] = {f"work.{name}": "real" for name in function.parameters}
    checker = ExpressionChecker(program, report, parameters)
    for op in function.body:
        if isinstance(op, Assign):
            checker.types[op.target] = checker.check(op.value)
        else:
            report("type", "a body has assignments only")
    yield from found
    if checker.types.get("work.y") != "real":
        yield Violation("assignment", place, "the result `work.y` is not assigned a real")
