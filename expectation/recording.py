"""Recording: what has to be recorded of a run so that expectations can be judged."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from fractions import Fraction

from expectation.expected import Expectation
from expectation.places import is_chart, mode_signals
from language.model.system import Scenario, System
from language.text.diagnostic import Problems

MAX_ROWS = 1_000_000
"""More rows are a mistake of a horizon, or of a period."""


def select_recorded_signals(
    scenario: Scenario, system: System, expectations: Sequence[Expectation], problems: Problems
) -> Scenario:
    """Return a scenario that records the signals that are read, at least one.

    The modes of charts are recorded at their ticks: their transitions do not tell them all.
    """
    read = [n for e in expectations for c in e.conditions for n in c.all_signals]
    every = scenario.every
    for name, instance in system.instances.items():
        automaton = instance.automaton
        if is_chart(system, name) and "mode" in automaton.outputs:
            read += mode_signals(system, name)
            if automaton.period:
                every = _common_period(every, automaton.period, instance.offset)
    horizon = scenario.horizon
    if every != scenario.every and horizon and horizon / every > MAX_ROWS:
        label = f"rows at all ticks of its charts are more than {MAX_ROWS}"
        problems.error("range", scenario.span, label, "a shorter `horizon`")
    signals = tuple(dict.fromkeys(read)) or system.signals[:1]
    return dataclasses.replace(scenario, signals=signals, every=every)


def _common_period(every: Fraction, period: Fraction, offset: Fraction) -> Fraction:
    """Return the largest time of which all three are whole multiples [s]."""
    times = (every, period, offset)
    whole = math.lcm(*(time.denominator for time in times))
    return Fraction(math.gcd(*(int(time * whole) for time in times)), whole)
