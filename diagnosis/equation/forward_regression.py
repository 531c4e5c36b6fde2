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
class TermColumns:
    """A term as columns of a problem, at `places`; with `has_own` each recording has its own."""

    name: str
    places: tuple[int, ...]
    has_recording_coefficients: bool


@dataclass(frozen=True)
class RegressionProblem:
    """`products` (recordings, parts, columns, columns): of columns with each other, and of the
    innovations (the last one). The first `parameters` columns are in units of priors. `samples`
    innovations there are, `inflation` of them count as one.
    """

    products: Reals = field(repr=False)
    parameters: int
    samples: int
    integrated_autocorrelation: float


@dataclass(frozen=True)
class SelectedTerm:
    """A term that was chosen: what it gains beside those before it [nats], after its price."""

    columns: TermColumns
    gain: float
    cross_validated: float


def build_problem(
    innovations: Sequence[Reals],
    parameters: Sequence[Reals],
    features: Sequence[Reals],
    integrated_autocorrelation: float,
) -> RegressionProblem:
    """Return the problem of innovations (samples,) of each recording, over their deviations.

    `parameters` (samples, parameters) and `features` (samples, columns) are how they fall with each.
    """
    products = []
    for e, moved, wave in zip(innovations, parameters, features, strict=True):
        whole = np.column_stack([moved, wave, e])
        products.append([part.T @ part for part in np.array_split(whole, FOLDS)])
    count = sum(len(e) for e in innovations)
    return RegressionProblem(
        np.array(products), parameters[0].shape[1], count, integrated_autocorrelation
    )


def rank_terms(
    problem: RegressionProblem, columns: Sequence[TermColumns]
) -> list[tuple[float, TermColumns]]:
    """Return each term alone with what it gains [nats] after its price, the best first."""
    before = _cost(problem, [])
    ranked = [
        (before - _cost(problem, [one]) - _complexity_penalty(problem, one), one) for one in columns
    ]
    return sorted(ranked, key=lambda pair: -pair[0])


def select_terms(
    problem: RegressionProblem, columns: Sequence[TermColumns], max_terms: int, min_gain: float
) -> list[SelectedTerm]:
    """Return the terms one after the other, as long as each gains `min_gain` nats.

    Those behind the first have to gain as much in parts of the recordings that were left out.
    """
    chosen: list[SelectedTerm] = []
    selected: list[TermColumns] = []
    while len(chosen) < max_terms:
        before = _cost(problem, selected)
        rest = [one for one in columns if one not in selected]
        gains = [
            before - _cost(problem, [*selected, one]) - _complexity_penalty(problem, one)
            for one in rest
        ]
        if not gains or max(gains) < min_gain:
            break
        best = rest[int(np.argmax(gains))]
        left_out = _cross_validated_cost(problem, selected) - _cross_validated_cost(
            problem, [*selected, best]
        )
        if selected and left_out < min_gain:
            break
        selected.append(best)
        chosen.append(SelectedTerm(best, max(gains), left_out))
    return chosen


def coefficients_of(problem: RegressionProblem, selected: Sequence[TermColumns]) -> list[Reals]:
    """Return the coefficients of each term (recordings, waves)."""
    fit = _solve_least_squares(problem, selected, np.sum(problem.products, axis=1))
    shared, own = problem.parameters, 0
    coefficients = []
    for one in selected:
        width = len(one.places)
        if one.has_recording_coefficients:
            coefficients.append(fit.per_recording[:, own : own + width])
            own += width
        else:
            part = fit.shared[shared : shared + width]
            coefficients.append(np.tile(part, (len(problem.products), 1)))
            shared += width
    return coefficients


def _complexity_penalty(problem: RegressionProblem, term: TermColumns) -> float:
    count = len(term.places) * (len(problem.products) if term.has_recording_coefficients else 1)
    return float(
        0.5 * count * np.log(max(problem.samples / problem.integrated_autocorrelation, 2.0))
    )


def _cost(problem: RegressionProblem, selected: Sequence[TermColumns]) -> float:
    """Return half the squares that are left [nats], over the inflation."""
    fit = _solve_least_squares(problem, selected, np.sum(problem.products, axis=1))
    return 0.5 * fit.residual_squares / problem.integrated_autocorrelation


def _cross_validated_cost(problem: RegressionProblem, selected: Sequence[TermColumns]) -> float:
    """Return half the squares of each part as the other parts foresee it [nats]."""
    total = 0.0
    recordings = np.arange(len(problem.products))
    for fold in range(FOLDS):
        tested = (fold + recordings) % FOLDS
        part = problem.products[recordings, tested]
        fit = _solve_least_squares(problem, selected, np.sum(problem.products, axis=1) - part)
        for r in recordings:
            inner, right = _selected_products(problem, selected, part[r])
            x = np.concatenate([fit.shared, fit.per_recording[r]])
            total += float(part[r][-1, -1] - 2.0 * right @ x + x @ inner @ x)
    return 0.5 * total / problem.integrated_autocorrelation


@dataclass(frozen=True)
class _LeastSquaresFit:
    """Coefficients: `shared`, `own` (recordings, own); the squares that are `left`, with priors."""

    shared: Reals
    per_recording: Reals
    residual_squares: float


def _solve_least_squares(
    problem: RegressionProblem, selected: Sequence[TermColumns], products: Reals
) -> _LeastSquaresFit:
    """Return the coefficients by least squares; those of one recording are eliminated first."""
    shared = problem.parameters + sum(
        len(one.places) for one in selected if not one.has_recording_coefficients
    )
    a, g, whole = np.zeros((shared, shared)), np.zeros(shared), 0.0
    a[: problem.parameters, : problem.parameters] = np.eye(problem.parameters)
    inside = []
    for one in products:
        gram, right = _selected_products(problem, selected, one)
        gram = gram + RIDGE * np.diag(np.diag(gram) + 1e-12)
        cross, rest = gram[:shared, shared:], right[shared:]
        solved = np.linalg.solve(gram[shared:, shared:], np.column_stack([cross.T, rest]))
        a += gram[:shared, :shared] - cross @ solved[:, :-1]
        g += right[:shared] - cross @ solved[:, -1]
        whole += float(one[-1, -1]) - float(rest @ solved[:, -1])
        inside.append(solved)
    common = np.asarray(np.linalg.solve(a, g), dtype=np.float64)
    own = np.array([one[:, -1] - one[:, :-1] @ common for one in inside])
    return _LeastSquaresFit(common, own, whole - float(g @ common))


def _selected_products(
    problem: RegressionProblem, selected: Sequence[TermColumns], products: Reals
) -> tuple[Reals, Reals]:
    """Return the products of the columns in use: parameters, shared terms, terms of a recording."""
    shared = [
        place for one in selected if not one.has_recording_coefficients for place in one.places
    ]
    own = [place for one in selected if one.has_recording_coefficients for place in one.places]
    places = [*range(problem.parameters), *shared, *own]
    return products[np.ix_(places, places)], products[places, -1]
