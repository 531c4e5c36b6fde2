"""Eigen: eigenvalues against numpy, and the entry that sets one against finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from language.numerics.eigenvalues import dominant_entry, eigenvalues
from language.numerics.matrix import Matrix

ROUNDING = 1e-13
"""Of the norm of the matrix: hundreds of roundings of 1e-16."""


def rows(a: object) -> Matrix:
    return tuple(tuple(float(x) for x in row) for row in np.asarray(a))


def farthest(ours: tuple[complex, ...], theirs: list[complex]) -> float:
    """Return the largest distance of eigenvalues, each paired with the nearest one left."""
    assert len(ours) == len(theirs)
    worst = 0.0
    for value in ours:
        nearest = min(theirs, key=lambda other: abs(other - value))
        worst = max(worst, abs(nearest - value))
        theirs.remove(nearest)
    return worst


@pytest.mark.parametrize("n", range(1, 9))
def test_eigenvalues_are_those_of_numpy(n: int) -> None:
    random = np.random.default_rng(n)
    for _ in range(40):
        a = random.normal(size=(n, n)) * 10.0 ** random.integers(-3, 4, size=(n, n))
        scale = float(np.linalg.norm(a))
        assert farthest(eigenvalues(rows(a)), list(np.linalg.eigvals(a))) <= ROUNDING * scale


def test_known_eigenvalues() -> None:
    assert eigenvalues(((2.0,),)) == (2.0,)
    assert sorted(v.imag for v in eigenvalues(((0.0, 1.0), (-9.0, 0.0)))) == [-3.0, 3.0]
    chain = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    assert all(abs(value) < 1e-5 for value in eigenvalues(chain))
    assert set(eigenvalues(((0.0, 0.0), (0.0, 0.0)))) == {0.0}


def test_what_has_no_eigenvalues_is_refused() -> None:
    with pytest.raises(ValueError):
        eigenvalues(((1.0, 2.0),))
    with pytest.raises(ValueError):
        eigenvalues(((float("nan"),),))


@pytest.mark.parametrize("seed", range(12))
def test_the_governing_entry_moves_the_eigenvalue_most_when_all_change_by_a_percent(
    seed: int,
) -> None:
    a = np.random.default_rng(seed).normal(size=(4, 4))
    (value, *_) = sorted(eigenvalues(rows(a)), key=abs, reverse=True)
    moved = {}
    for i in range(4):
        for j in range(4):
            changed = a.copy()
            changed[i, j] *= 1.0 + 1e-6
            moved[i, j] = min(abs(other - value) for other in np.linalg.eigvals(changed))
    best = dominant_entry(rows(a), value)
    assert moved[best] == pytest.approx(max(moved.values()), rel=1e-3)
