"""Regression: which terms explain innovations, sparsely (forward, by BIC, each part left out).

All that is needed of the data are products of columns, part by part of each recording: made once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
FOLDS = 4
"""Parts of each recording, one of which is left out at a time."""
RIDGE = 1e-6
"""Added to products of a column with itself, as a part of them: columns may be alike."""


@dataclass(frozen=True)
class Columns:
    """A term as columns of a problem, at `places`; with `has_own` each recording has its own."""

    name: str
    places: tuple[int, ...]
    has_own: bool


@dataclass(frozen=True)
class Problem:
    """`products` (recordings, parts, columns, columns): of columns with each other, and of the
    innovations (the last one). The first `parameters` columns are in units of priors. `samples`
    innovations there are, `inflation` of them count as one.
    """

    products: Reals = field(repr=False)
    parameters: int
    samples: int
    inflation: float


@dataclass(frozen=True)
class Chosen:
    """A term that was chosen: what it gains beside those before it [nats], after its price."""

    columns: Columns
    gain: float
    left_out: float


def problem_of(
    innovations: Sequence[Reals],
    parameters: Sequence[Reals],
    waves: Sequence[Reals],
    inflation: float,
) -> Problem:
    """Return the problem of innovations (samples,) of each recording, over their deviations.

    `parameters` (samples, parameters) and `waves` (samples, columns) are how they fall with each.
    """
    products = []
    for e, moved, wave in zip(innovations, parameters, waves, strict=True):
        whole = np.column_stack([moved, wave, e])
        products.append([part.T @ part for part in np.array_split(whole, FOLDS)])
    count = sum(len(e) for e in innovations)
    return Problem(np.array(products), parameters[0].shape[1], count, inflation)


def ranking(problem: Problem, columns: Sequence[Columns]) -> list[tuple[float, Columns]]:
    """Return each term alone with what it gains [nats] after its price, the best first."""
    before = _cost(problem, [])
    found = [(before - _cost(problem, [one]) - _price(problem, one), one) for one in columns]
    return sorted(found, key=lambda pair: -pair[0])


def forward(problem: Problem, columns: Sequence[Columns], most: int, least: float) -> list[Chosen]:
    """Return the terms one after the other, as long as each gains `least` nats.

    Those behind the first have to gain as much in parts of the recordings that were left out.
    """
    chosen: list[Chosen] = []
    kept: list[Columns] = []
    while len(chosen) < most:
        before = _cost(problem, kept)
        rest = [one for one in columns if one not in kept]
        gains = [before - _cost(problem, [*kept, one]) - _price(problem, one) for one in rest]
        if not gains or max(gains) < least:
            break
        best = rest[int(np.argmax(gains))]
        left_out = _left_out(problem, kept) - _left_out(problem, [*kept, best])
        if kept and left_out < least:
            break
        kept.append(best)
        chosen.append(Chosen(best, max(gains), left_out))
    return chosen


def weights(problem: Problem, kept: Sequence[Columns]) -> list[Reals]:
    """Return the coefficients of each term (recordings, waves)."""
    fit = _fitted(problem, kept, np.sum(problem.products, axis=1))
    shared, own = problem.parameters, 0
    found = []
    for one in kept:
        width = len(one.places)
        if one.has_own:
            found.append(fit.own[:, own : own + width])
            own += width
        else:
            part = fit.shared[shared : shared + width]
            found.append(np.tile(part, (len(problem.products), 1)))
            shared += width
    return found


def _price(problem: Problem, one: Columns) -> float:
    count = len(one.places) * (len(problem.products) if one.has_own else 1)
    return float(0.5 * count * np.log(max(problem.samples / problem.inflation, 2.0)))


def _cost(problem: Problem, kept: Sequence[Columns]) -> float:
    """Return half the squares that are left [nats], over the inflation."""
    fit = _fitted(problem, kept, np.sum(problem.products, axis=1))
    return 0.5 * fit.left / problem.inflation


def _left_out(problem: Problem, kept: Sequence[Columns]) -> float:
    """Return half the squares of each part as the other parts foresee it [nats]."""
    total = 0.0
    recordings = np.arange(len(problem.products))
    for fold in range(FOLDS):
        tested = (fold + recordings) % FOLDS
        part = problem.products[recordings, tested]
        fit = _fitted(problem, kept, np.sum(problem.products, axis=1) - part)
        for r in recordings:
            inner, right = _chosen(problem, kept, part[r])
            x = np.concatenate([fit.shared, fit.own[r]])
            total += float(part[r][-1, -1] - 2.0 * right @ x + x @ inner @ x)
    return 0.5 * total / problem.inflation


@dataclass(frozen=True)
class _Fit:
    """Coefficients: `shared`, `own` (recordings, own); the squares that are `left`, with priors."""

    shared: Reals
    own: Reals
    left: float


def _fitted(problem: Problem, kept: Sequence[Columns], products: Reals) -> _Fit:
    """Return the coefficients by least squares; those of one recording are eliminated first."""
    shared = problem.parameters + sum(len(one.places) for one in kept if not one.has_own)
    a, g, whole = np.zeros((shared, shared)), np.zeros(shared), 0.0
    a[: problem.parameters, : problem.parameters] = np.eye(problem.parameters)
    inside = []
    for one in products:
        gram, right = _chosen(problem, kept, one)
        gram = gram + RIDGE * np.diag(np.diag(gram) + 1e-12)
        cross, rest = gram[:shared, shared:], right[shared:]
        solved = np.linalg.solve(gram[shared:, shared:], np.column_stack([cross.T, rest]))
        a += gram[:shared, :shared] - cross @ solved[:, :-1]
        g += right[:shared] - cross @ solved[:, -1]
        whole += float(one[-1, -1]) - float(rest @ solved[:, -1])
        inside.append(solved)
    common = np.asarray(np.linalg.solve(a, g), dtype=np.float64)
    own = np.array([one[:, -1] - one[:, :-1] @ common for one in inside])
    return _Fit(common, own, whole - float(g @ common))


def _chosen(problem: Problem, kept: Sequence[Columns], products: Reals) -> tuple[Reals, Reals]:
    """Return the products of the columns in use: parameters, shared terms, terms of a recording."""
    shared = [place for one in kept if not one.has_own for place in one.places]
    own = [place for one in kept if one.has_own for place in one.places]
    places = [*range(problem.parameters), *shared, *own]
    return products[np.ix_(places, places)], products[places, -1]
