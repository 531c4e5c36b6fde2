"""Conversion: how a raw number of the C is shown by a tool: with its unit, by a name, in ms."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from language.program import TICKS, Constant, Program, Variable, fired_variable
from language.units import shown_unit


@dataclass(frozen=True)
class Conversion:
    """A unit alone (COMPU_METHOD IDENTICAL), with a `factor` (LINEAR), or `names` of numbers
    (TAB_VERB).
    """

    unit: str = ""
    factor: float = 1.0
    names: tuple[tuple[int, str], ...] = ()


TRUTH = Conversion(names=((0, "false"), (1, "true")))
COUNT = Conversion()
PER_SECOND = 1000
"""A counter of ticks is shown in ms."""


def conversion_of(item: Variable | Constant, program: Program) -> Conversion:
    """Return how a variable or constant of a Program is shown."""
    if item.values:
        return Conversion(names=tuple(enumerate(item.values)))
    if item.type == "real":
        return Conversion("" if item.unit == "1" else shown_unit(item.unit))
    if item.type == "truth":
        return TRUTH
    is_count = item.name.startswith("timer.") or item.unit == TICKS
    if is_count and program.period:
        return Conversion("ms", float(program.period * PER_SECOND))
    return _numbered(program).get(item.name, COUNT)


def _numbered(program: Program) -> dict[str, Conversion]:
    """Return the variables that hold numbers of modes and transitions."""
    found = {
        variable: Conversion(names=tuple((m.number, m.name) for m in program.modes_of(region)))
        for region, variable in program.mode_variables().items()
    }
    for region in program.mode_variables():
        taken = [(t.number, t.name) for t in program.transitions if t.region == region]
        found[fired_variable(region)] = Conversion(names=((0, "none"), *_apart(taken)))
    run = tuple((mode.number, mode.name) for mode in program.run_modes)
    return {**found, "memory.run_mode": Conversion(names=run)} if run else found


def _apart(named: list[tuple[int, str]]) -> list[tuple[int, str]]:
    """Return names of numbers, those that several have with the number."""
    count = Counter(name for _, name in named)
    return [(n, f"{name} {n}" if count[name] > 1 else name) for n, name in named]
