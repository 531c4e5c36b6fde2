"""Stamp: solved numbers know the tunables that they came from; a change sets a fault bit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from language.ir.ops import Block, Branch, Compare, FaultBit, Op, Ref
from language.ir.program import Constant
from language.model.automaton import Automaton
from language.text.diagnostic import Problems

STALE_CALIBRATION = "stale_calibration"
COMPARE_STAMPS = "compare_stamps"
"""The block that compares: run before the first tick and after a change of the page (rule C15)."""


def calibration_stamps(
    automaton: Automaton,
    constants: Iterable[Constant],
    parameters: Mapping[str, Constant],
    problems: Problems,
) -> tuple[Constant, ...]:
    """Return a stamp for each tunable that enters a solved number: its value then (rule 17g)."""
    found = []
    for name in sorted({name for constant in constants for name in constant.depends_on}):
        parameter = parameters[name]
        if parameter.items:
            label = f"`{name}` enters what is solved when the spec is checked: it is not tunable"
            problems.error("table", automaton.parameters[name].span, label)
        else:
            stamp = f"solved.stamp_{name}"
            unit = parameter.unit
            found.append(Constant(stamp, "solved", parameter.value, unit, depends_on=(name,)))
    return tuple(found)


def compare_stamps_block(stamps: Iterable[Constant]) -> Block:
    """Return what compares the calibration with the stamps."""
    ops: list[Op] = []
    for stamp in stamps:
        (name,) = stamp.depends_on
        changed = Compare("!=", Ref(f"calibration.{name}"), Ref(stamp.name))
        ops.append(Branch(changed, (FaultBit(STALE_CALIBRATION),)))
    return tuple(ops)
