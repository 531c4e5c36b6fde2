"""Fourier-Motzkin elimination: decides whether linear inequalities have no real solution.

The arithmetic is exact (Fourier 1827, Motzkin 1936).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

MAX_INEQUALITIES = 60
"""Largest number of inequalities during the elimination; beyond it the result is undecided."""
Inequality = tuple[Mapping[str, Fraction], Fraction, bool]
"""Coefficients, constant and strictness.

The sum of coefficients times variables plus the constant is > 0 if strict, else >= 0.
"""


def is_infeasible(inequalities: Sequence[Inequality]) -> bool:
    """Return whether elimination proves that no real values fulfil all inequalities.

    The result is False if a solution exists or if more than MAX_INEQUALITIES inequalities arise.
    The variable that creates the fewest new inequalities is eliminated first, ties by name.
    A variable with the coefficient 0 does not occur.
    """
    remaining: list[Inequality] = [
        (_without_zeros(factors), constant, is_strict)
        for factors, constant, is_strict in inequalities
    ]
    while len(remaining) <= MAX_INEQUALITIES:
        if any(_is_contradiction(inequality) for inequality in remaining):
            return True
        names = sorted({name for factors, _, _ in remaining for name in factors})
        if not names:
            return False
        remaining = _eliminate_variable(
            min(names, key=lambda name: _pair_count(remaining, name)), remaining
        )
    return False


def _is_contradiction(inequality: Inequality) -> bool:
    """Return whether an inequality has no variables and is false."""
    factors, constant, is_strict = inequality
    return not factors and (constant < 0 or (is_strict and constant == 0))


def _pair_count(inequalities: Sequence[Inequality], name: str) -> int:
    """Return the number of inequalities that the elimination of a variable creates."""
    signs = [factors[name] > 0 for factors, _, _ in inequalities if name in factors]
    return signs.count(True) * signs.count(False)


def _eliminate_variable(name: str, inequalities: Sequence[Inequality]) -> list[Inequality]:
    """Return the inequalities without a variable.

    Each pair of an inequality that bounds it from below and one that bounds it from above is
    combined.
    """
    rising = [each for each in inequalities if each[0].get(name, 0) > 0]
    falling = [each for each in inequalities if each[0].get(name, 0) < 0]
    result = [each for each in inequalities if name not in each[0]]
    for first in rising:
        for second in falling:
            result.append(_combine(name, first, second))
    return result


def _combine(name: str, first: Inequality, second: Inequality) -> Inequality:
    """Return the positive combination of two inequalities in which a variable cancels.

    Zero coefficients are left out.
    """
    a, b = -second[0][name], first[0][name]
    factors = {other: a * value for other, value in first[0].items()}
    for other, value in second[0].items():
        factors[other] = factors.get(other, Fraction(0)) + b * value
    return _without_zeros(factors), a * first[1] + b * second[1], first[2] or second[2]


def _without_zeros(factors: Mapping[str, Fraction]) -> dict[str, Fraction]:
    """Return the coefficients that are not 0."""
    return {name: value for name, value in factors.items() if value}
