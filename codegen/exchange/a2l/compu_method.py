"""Conversions (A2L COMPU_METHOD): unit, factor or names by which a tool displays a number."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from language.expressions.units import display_unit
from language.ir.program import TICK_UNIT, Constant, Program, Variable, fired_variable


@dataclass(frozen=True)
class Conversion:
    """A conversion from a raw number to its display.

    It has a unit alone (COMPU_METHOD IDENTICAL), a `factor` (LINEAR), or `names` of numbers
    (TAB_VERB).
    """

    unit: str = ""
    factor: float = 1.0
    names: tuple[tuple[int, str], ...] = ()


TRUTH = Conversion(names=((0, "false"), (1, "true")))
"""The conversion of a truth value."""
COUNT = Conversion()
"""The conversion of a number without a unit."""
MS_PER_SECOND = 1000
"""Milliseconds in a second; counters of ticks are displayed in ms."""


def conversion_of(item: Variable | Constant, program: Program) -> Conversion:
    """Return the conversion of a variable or constant.

    Enumerations, truth values, and variables with the number of a mode or transition have names. A
    real has its unit, empty for the unit `1`. A timer or value in ticks is displayed in ms if the
    Program has a period. All others are COUNT.
    """
    if item.values:
        return Conversion(names=tuple(enumerate(item.values)))
    if item.type == "real":
        return Conversion("" if item.unit == "1" else display_unit(item.unit))
    if item.type == "truth":
        return TRUTH
    is_count = item.name.startswith("timer.") or item.unit == TICK_UNIT
    if is_count and program.period:
        return Conversion("ms", float(program.period * MS_PER_SECOND))
    return _enumerated_variables(program).get(item.name, COUNT)


def _enumerated_variables(program: Program) -> dict[str, Conversion]:
    """Return the conversions of variables with numbers of modes and transitions, by name."""
    conversions = {
        variable: Conversion(names=tuple((m.number, m.name) for m in program.modes_of(region)))
        for region, variable in program.mode_variables().items()
    }
    for region in program.mode_variables():
        transitions = [(t.number, t.name) for t in program.transitions if t.region == region]
        conversions[fired_variable(region)] = Conversion(
            names=((0, "none"), *_disambiguate(transitions))
        )
    run = tuple((mode.number, mode.name) for mode in program.run_modes)
    return {**conversions, "memory.run_mode": Conversion(names=run)} if run else conversions


def _disambiguate(names: list[tuple[int, str]]) -> list[tuple[int, str]]:
    """Return the named numbers; a name that occurs more than once gets its number appended."""
    count = Counter(name for _, name in names)
    return [(n, f"{name} {n}" if count[name] > 1 else name) for n, name in names]
