"""Forward regression: sparse selection of terms that explain innovations, with a BIC penalty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from diagnosis.data.array_types import Reals

FOLDS = 4
"""Number of parts of each recording; one is left out at a time."""
RIDGE = 1e-6
"""Relative ridge added to the diagonal of the products, because columns can be collinear."""


@dataclass(frozen=True)
class TermColumns:
    """A term as the columns `places` of a problem, with shared or recording coefficients."""

    name: str
    places: tuple[int, ...]
    has_recording_coefficients: bool


@dataclass(frozen=True)
class RegressionProblem:
    """The products of columns and innovations, (recordings, parts, columns, columns).

    The first `parameters` columns are parameters in prior standard deviations, the last one the
    innovations; `samples` is their number.
    """

    products: Reals = field(repr=False)
    parameters: int
    samples: int
    integrated_autocorrelation: float


def build_problem(
    innovations: Sequence[Reals],
    parameters: Sequence[Reals],
    features: Sequence[Reals],
    integrated_autocorrelation: float,
) -> RegressionProblem:
    """Return the regression problem of normalised innovations (samples,) of each recording.

    `parameters` (samples, parameters) and `features` (samples, columns) of each recording are the
    decreases of the innovations per unit of each coefficient.
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
    problem: RegressionProblem,
    columns: Sequence[TermColumns],
    selected: Sequence[TermColumns] = (),
) -> list[tuple[float, TermColumns]]:
    """Return the penalised gain [nats] of each further term with the term, in descending order."""
    before = _cost(problem, selected)
    ranked = [
        (before - _cost(problem, [*selected, one]) - _complexity_penalty(problem, one), one)
        for one in columns
        if one not in selected
    ]
    return sorted(ranked, key=lambda pair: -pair[0])


def select_terms(
    problem: RegressionProblem, columns: Sequence[TermColumns], max_terms: int, min_gain: float
) -> list[tuple[float, TermColumns]]:
    """Return the penalised gains [nats] and the terms of a forward selection, at most `max_terms`.

    It ends when the penalised gain, or the cross-validated one of a further term, is below
    `min_gain` [nats].
    """
    chosen: list[tuple[float, TermColumns]] = []
    while len(chosen) < max_terms:
        selected = [one for _, one in chosen]
        ranked = rank_terms(problem, columns, selected)
        if not ranked or ranked[0][0] < min_gain:
            break
        if selected:
            before = _cross_validated_cost(problem, selected)
            if before - _cross_validated_cost(problem, [*selected, ranked[0][1]]) < min_gain:
                break
        chosen.append(ranked[0])
    return chosen


def coefficients_of(problem: RegressionProblem, selected: Sequence[TermColumns]) -> list[Reals]:
    """Return the least-squares coefficients of each selected term, (recordings, waves) each."""
    shared, own, _ = _solve_least_squares(problem, selected, np.sum(problem.products, axis=1))
    first_shared, first_own = problem.parameters, 0
    coefficients = []
    for one in selected:
        width = len(one.places)
        if one.has_recording_coefficients:
            coefficients.append(own[:, first_own : first_own + width])
            first_own += width
        else:
            part = shared[first_shared : first_shared + width]
            coefficients.append(np.tile(part, (len(problem.products), 1)))
            first_shared += width
    return coefficients


def _complexity_penalty(problem: RegressionProblem, term: TermColumns) -> float:
    """Return the BIC penalty [nats] of a term, with the effective number of samples."""
    count = len(term.places) * (len(problem.products) if term.has_recording_coefficients else 1)
    effective = max(problem.samples / problem.integrated_autocorrelation, 2.0)
    return float(0.5 * count * np.log(effective))


def _cost(problem: RegressionProblem, selected: Sequence[TermColumns]) -> float:
    """Return half the residual squares [nats], over the integrated autocorrelation."""
    *_, squares = _solve_least_squares(problem, selected, np.sum(problem.products, axis=1))
    return 0.5 * squares / problem.integrated_autocorrelation


def _cross_validated_cost(problem: RegressionProblem, selected: Sequence[TermColumns]) -> float:
    """Return half the squares of each part as predicted from the other parts [nats]."""
    total = 0.0
    recordings = np.arange(len(problem.products))
    for fold in range(FOLDS):
        tested = (fold + recordings) % FOLDS
        part = problem.products[recordings, tested]
        others = np.sum(problem.products, axis=1) - part
        shared, own, _ = _solve_least_squares(problem, selected, others)
        for r in recordings:
            inner, right = _selected_products(problem, selected, part[r])
            x = np.concatenate([shared, own[r]])
            total += float(part[r][-1, -1] - 2.0 * right @ x + x @ inner @ x)
    return 0.5 * total / problem.integrated_autocorrelation


def _solve_least_squares(
    problem: RegressionProblem, selected: Sequence[TermColumns], products: Reals
) -> tuple[Reals, Reals, float]:
    """Return shared coefficients, those per recording (recordings, n), and squares with priors.

    The coefficients per recording are eliminated by Schur complements.
    """
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
    return common, own, whole - float(g @ common)


def _selected_products(
    problem: RegressionProblem, selected: Sequence[TermColumns], products: Reals
) -> tuple[Reals, Reals]:
    """Return the products of the used columns: parameters, shared terms, terms per recording."""
    shared_first = sorted(selected, key=lambda one: one.has_recording_coefficients)
    places = [*range(problem.parameters), *(place for one in shared_first for place in one.places)]
    return products[np.ix_(places, places)], products[places, -1]
