"""Waits of a sampled automaton in ticks, fixed or tunable (rule 4a).

A tunable wait is stored as a count of ticks. A time in seconds would be rounded to the number type
first, and the count could then be one tick too large.
"""

from __future__ import annotations

import math
from fractions import Fraction

from language.expressions.syntax_tree import Name
from language.ir.analysis_cache import cache_on_owner
from language.ir.program import MAX_TIMER_TICKS
from language.model.automaton import Automaton
from language.model.declaration import Formula, Parameter, Range
from language.model.used_names import names_read_by
from language.text.diagnostic import Problems

MAX_WAIT_TICKS = MAX_TIMER_TICKS - 1
"""The longest wait in ticks: the counters count one tick more (rule 4a)."""


def tunable_wait(automaton: Automaton, wait: Formula | None) -> str | None:
    """Return the name of the tunable parameter that is the wait of a transition.

    The wait has to be the name alone. The result is None for a wait that is absent or fixed, and in
    a continuous automaton.
    """
    if wait is None or not automaton.period or not isinstance(wait.tree, Name):
        return None
    parameter = automaton.parameters.get(wait.tree.path)
    return parameter.name if parameter and parameter.kind == "tunable" else None


@cache_on_owner
def tunable_waits(automaton: Automaton) -> frozenset[str]:
    """Return the names of the tunable parameters that are the wait of some transition."""
    waits = (tunable_wait(automaton, each.wait) for each in automaton.all_transitions)
    return frozenset(name for name in waits if name)


def seconds_to_ticks(automaton: Automaton, time: Fraction) -> int:
    """Return ceil(time / period): a time [s] in ticks of a sampled automaton, computed exactly."""
    assert automaton.period
    return math.ceil(time / automaton.period)


def ticks_to_seconds(automaton: Automaton, parameter: Parameter, ticks: int) -> Fraction:
    """Return a time [s] of a tunable wait that lasts a number of ticks.

    It is `ticks` periods, but at most the end of the declared range, which may lie inside the last
    tick.
    """
    assert automaton.period
    time = ticks * automaton.period
    is_last = parameter.range and ticks == seconds_to_ticks(automaton, parameter.range[1])
    return min(time, parameter.range[1]) if parameter.range and is_last else time


def wait_range_in_ticks(automaton: Automaton, parameter: Parameter) -> Range:
    """Return the smallest and the largest number of ticks of the waits in a declared range.

    Each end is rounded up to whole ticks, as a wait is. Without a declared range it is (0,
    MAX_WAIT_TICKS).
    """
    if parameter.range is None:
        return Fraction(0), Fraction(MAX_WAIT_TICKS)
    low, high = (seconds_to_ticks(automaton, end) for end in parameter.range)
    return Fraction(low), Fraction(high)


def check_tunable_waits(automaton: Automaton, problems: Problems) -> None:
    """Report each tunable wait that cannot be stored as a count of ticks.

    These are waits that are parameters of the model, that another formula reads too, or whose range
    is not usable. A range is usable if it lies within 0 to MAX_WAIT_TICKS. Nothing is raised.
    """
    waits = tunable_waits(automaton)
    if not waits:
        return
    read = set(names_read_by(automaton, include_waits=False))
    for name in sorted(waits):
        parameter = automaton.parameters[name]
        if automaton.model and name in automaton.model.parameters:
            label = f"`{name}` is a parameter of the model `{automaton.model.name}`"
            hint = "a tunable wait is stored in ticks: use a parameter that the model does not have"
            problems.error("wait", parameter.span, label, hint)
        elif name in read:
            label = f"`{name}` is a tunable wait, and read elsewhere too"
            hint = "a tunable wait is stored in ticks: use a separate parameter for it"
            problems.error("wait", parameter.span, label, hint)
        ticks = Fraction(seconds_to_ticks(automaton, parameter.value or Fraction(0)))
        most = max(ticks, wait_range_in_ticks(automaton, parameter)[1])
        if (parameter.range and parameter.range[0] < 0) or most > MAX_WAIT_TICKS:
            label = f"`{name}` is a wait: its range is within 0 to {MAX_WAIT_TICKS} ticks"
            problems.error("wait", parameter.span, label)
