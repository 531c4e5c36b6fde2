"""Time resolution: the step of a prediction that follows the fastest dynamics of a model."""

from __future__ import annotations

from fractions import Fraction

from language.model.automaton import Automaton
from language.programs.continuous_program import stable_step_limits

STEP_RATE_PRODUCT = Fraction(1, 2)
"""Largest |eigenvalue| times step; the relative error of an RK4 step is then 0.5^5 / 120 = 3e-4."""
SHORTEST_STEP = Fraction(1, 10**6)
"""Shortest step [s], whatever the eigenvalues are."""


def time_resolution(automaton: Automaton, longest: Fraction) -> Fraction:
    """Return the longest step [s] that follows the fastest damped component of a model.

    It is `STEP_RATE_PRODUCT` over the largest magnitude of an eigenvalue at the declared
    parameters, over all modes, at most `longest` and at least `SHORTEST_STEP`. Sampled automata and
    exponential methods give `longest`.
    """
    if automaton.is_sampled:
        return longest
    rates = [abs(limit.eigenvalue) for limit in stable_step_limits(automaton)]
    fastest = Fraction(max(rates, default=0.0)).limit_denominator(10**6)
    step = STEP_RATE_PRODUCT / fastest if fastest else longest
    return max(min(step, longest), SHORTEST_STEP)
