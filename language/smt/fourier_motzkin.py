"""Elimination: whether linear inequalities have no solution, exactly (Fourier 1827, Motzkin)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

MAX_INEQUALITIES = 60
"""Inequalities at any time; where there are more of them nothing is found out."""
Inequality = tuple[Mapping[str, Fraction], Fraction, bool]
"""`sum of factors * variables + constant` is above 0 if strict, else not below it."""


def is_infeasible(inequalities: Sequence[Inequality]) -> bool:
    """Tell whether it is found that no values fulfil all inequalities."""
    remaining = list(inequalities)
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
    factors, constant, is_strict = inequality
    return not factors and (constant < 0 or (is_strict and constant == 0))


def _pair_count(inequalities: Sequence[Inequality], name: str) -> int:
    signs = [factors[name] > 0 for factors, _, _ in inequalities if name in factors]
    return signs.count(True) * signs.count(False)


def _eliminate_variable(name: str, inequalities: Sequence[Inequality]) -> list[Inequality]:
    """Return what follows for the other variables: each lower bound is below each upper one."""
    rising = [each for each in inequalities if each[0].get(name, 0) > 0]
    falling = [each for each in inequalities if each[0].get(name, 0) < 0]
    found = [each for each in inequalities if name not in each[0]]
    for first in rising:
        for second in falling:
            found.append(_combine(name, first, second))
    return found


def _combine(name: str, first: Inequality, second: Inequality) -> Inequality:
    a, b = -second[0][name], first[0][name]
    factors = {other: a * value for other, value in first[0].items()}
    for other, value in second[0].items():
        factors[other] = factors.get(other, Fraction(0)) + b * value
    kept = {other: value for other, value in factors.items() if value}
    return kept, a * first[1] + b * second[1], first[2] or second[2]
