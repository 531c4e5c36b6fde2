"""Fourier-Motzkin elimination: which systems of linear inequalities are proven infeasible."""

from __future__ import annotations

from fractions import Fraction

import pytest

from language.smt.fourier_motzkin import Inequality, is_infeasible


def inequality(constant: int, is_strict: bool = False, **factors: int) -> Inequality:
    """Return `sum of factors + constant > 0` (strict) or `>= 0`."""
    coefficients = {name: Fraction(factor) for name, factor in factors.items()}
    return coefficients, Fraction(constant), is_strict


@pytest.mark.parametrize(
    ("inequalities", "expected"),
    [
        ([inequality(-1, x=1), inequality(0, x=-1)], True),  # 1 <= x <= 0
        ([inequality(-1, x=1), inequality(1, x=-1)], False),  # x == 1
        ([inequality(-1, True, x=1), inequality(1, x=-1)], True),  # 1 < x <= 1
        ([inequality(0, x=1, y=-1), inequality(-1, x=-1, y=1)], True),  # x >= y >= x + 1
        ([inequality(-1)], True),
        ([], False),
    ],
)
def test_an_infeasible_system_is_recognised(inequalities: list[Inequality], expected: bool) -> None:
    assert is_infeasible(inequalities) == expected


@pytest.mark.parametrize(
    "inequalities",
    [
        [inequality(-1, x=0)],  # 0 x >= 1
        [inequality(0, True, x=0)],  # 0 x > 0
        [inequality(-1, x=1, y=0), inequality(0, x=-1, y=0), inequality(3, y=1)],
        [inequality(-1, x=1), inequality(0, x=-1), inequality(0, x=0, y=2)],
    ],
)
def test_a_variable_with_the_coefficient_0_does_not_occur(inequalities: list[Inequality]) -> None:
    assert is_infeasible(inequalities)
