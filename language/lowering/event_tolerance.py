"""Tolerance of simultaneous events: times that differ by less are one instant (rule 10)."""

from __future__ import annotations

from fractions import Fraction

from language.ir.number_type import SIGNIFICAND_BITS, NumberType
from language.model.automaton import Automaton

MERGE_ULPS = 4096
"""Events that are closer than this are one instant (rule 10).

Rounding moves a crossing by about ten units in the last place.
"""


def merge_time(number: NumberType, step: Fraction) -> float:
    """Return the time [s] within which events are one instant (rule 10).

    It is MERGE_ULPS units in the last place of the step [s]: in float64 0.9 ps for 1 s, in float32
    0.5 us for 1 ms.
    """
    return float(step) * MERGE_ULPS * 2.0 ** (1 - SIGNIFICAND_BITS[number])


def is_instantaneous(automaton: Automaton, time: Fraction) -> bool:
    """Return whether a wait or `after` of a continuous automaton ends at the instant of its start.

    This holds for a time [s] of at most `merge_time` of one major step. A flow over such a time
    would divide by the square of a number that may round to zero.
    """
    return time <= merge_time(automaton.numbers, automaton.step)
