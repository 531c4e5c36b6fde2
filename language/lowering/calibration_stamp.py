"""Calibration stamps: a fault bit for solved numbers that do not belong to the page (rule 17g)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from language.ir.ops import Block, Branch, Compare, FaultBit, Op, Ref
from language.ir.program import Constant
from language.model.automaton import Automaton
from language.text.diagnostic import Problems

STALE_CALIBRATION = "stale_calibration"
"""The fault bit of a calibration page that does not match the stamps."""
COMPARE_STAMPS = "compare_stamps"
"""The block that compares; it runs before the first tick and after a change of the page (rule C15).
"""


def calibration_stamps(
    automaton: Automaton,
    constants: Iterable[Constant],
    parameters: Mapping[str, Constant],
    problems: Problems,
) -> tuple[Constant, ...]:
    """Return a constant `solved.stamp_<name>` for each tunable that a solved number reads.

    They are sorted by name. The value is that of the parameter when the spec was checked.
    `parameters` are the constants by the name of the parameter. A tunable table is reported as an
    error and has no stamp, since it has no single value.
    """
    found = []
    for name in sorted({name for constant in constants for name in constant.depends_on}):
        parameter = parameters[name]
        if parameter.items:
            label = f"`{name}` enters numbers that are solved at check time: it cannot be tunable"
            problems.error("table", automaton.parameters[name].span, label)
        else:
            stamp = f"solved.stamp_{name}"
            unit = parameter.unit
            found.append(Constant(stamp, "solved", parameter.value, unit, depends_on=(name,)))
    return tuple(found)


def compare_stamps_block(stamps: Iterable[Constant]) -> Block:
    """Return the operations that set the fault bit `stale_calibration` for stamps that differ.

    Each stamp is compared with the tunable parameter that it belongs to.
    """
    ops: list[Op] = []
    for stamp in stamps:
        (name,) = stamp.depends_on
        changed = Compare("!=", Ref(f"calibration.{name}"), Ref(stamp.name))
        ops.append(Branch(changed, (FaultBit(STALE_CALIBRATION),)))
    return tuple(ops)
