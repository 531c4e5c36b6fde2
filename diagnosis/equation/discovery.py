"""Equation discovery: a formula for an unknown disturbance, fitted as an effect of the language."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from diagnosis.criterion.explained_share import MIN_SHARE, explained_share, least_variances
from diagnosis.equation.effect_text import FormulaEffect, build_formula
from diagnosis.equation.forward_regression import (
    TermColumns,
    coefficients_of,
    rank_terms,
    select_terms,
)
from diagnosis.equation.regression_problem import EquationRegression, regression_at
from diagnosis.estimation.covariance import quantities_of
from diagnosis.estimation.estimate import Estimate, evaluate
from diagnosis.estimation.levenberg_marquardt import estimate_parameters
from diagnosis.estimation.model_set import ModelSet
from diagnosis.localisation.location import Location
from diagnosis.model.parameter_vector import ParameterVector, vector_of
from diagnosis.selection.comparison import Round, effective_gain
from diagnosis.selection.intersample import LogCallback
from language.text.diagnostic import SpecError

MAX_LOCATIONS = 2
"""Number of locations that are searched, those with the largest gains."""
MAX_FITS = 3
"""Number of formulas that are fitted, the best ones of the regressions."""
MAX_TERMS = 2
LEADING_FRACTION = 0.85
"""Fraction of the best gain that suffices for a formula at a location of higher rank."""
MIN_SECOND_TERM_GAIN = 45.0
"""Smallest gain [nats] of a second term."""


@dataclass(frozen=True)
class DiscoveredEquation:
    """A formula at a location with its fit; `text` shows it with its values."""

    location: Location
    formula: FormulaEffect
    estimate: Estimate = field(repr=False)
    gain: float
    share: float
    text: str


def discover_equation(
    model_set: ModelSet,
    compared: Round,
    locations: Sequence[Location],
    min_gain: float,
    log: LogCallback = lambda text: None,
) -> DiscoveredEquation | None:
    """Return the formula with the largest gain over the base of a comparison, or None.

    `MAX_FITS` formulas at the first `MAX_LOCATIONS` locations with a gain and no accepted effect
    are fitted. The formula must gain `min_gain` [nats] and explain `MIN_SHARE`. One at a location
    of higher rank, fitted again from the best one, replaces it with `LEADING_FRACTION` of its gain.
    """
    base, equations = compared.base, []
    for formula, location in _propose_formulas(model_set, base, locations):
        starts = [base.values(0), _values_beside_disturbance(base, location)]
        one = _fit_formula(model_set, compared, formula, location, starts)
        if one is not None:
            log(_format_equation(one))
            equations.append(one)
    best = max(equations, key=lambda one: one.gain, default=None)
    if best is None or best.gain < min_gain or best.share < MIN_SHARE:
        return None
    ranks = [location.path for location in locations]
    for one in equations:
        if ranks.index(one.location.path) < ranks.index(best.location.path):
            starts = [best.estimate.values(0)]
            again = _fit_formula(model_set, compared, one.formula, one.location, starts)
            if again is not None and again.gain > LEADING_FRACTION * best.gain:
                log(_format_equation(again))
                best = again
    return best


def _format_equation(equation: DiscoveredEquation) -> str:
    """Return a formula with its location, gain and share as one line."""
    told = f"{equation.gain:.0f} nats, {100.0 * equation.share:.0f} %"
    return f"{equation.text} at {equation.location.path}: {told}"


def _propose_formulas(
    model_set: ModelSet, base: Estimate, locations: Sequence[Location]
) -> list[tuple[FormulaEffect, Location]]:
    """Return up to `MAX_FITS` formulas: the best at each location, then the next best.

    They are the best single terms and a pair of terms at each location.
    """
    options: list[tuple[float, Location, EquationRegression, tuple[TermColumns, ...]]] = []
    places = [one for one in locations if one.gain > 0.0 and not one.is_accepted][:MAX_LOCATIONS]
    for location in places:
        point = vector_of(
            base.candidate, len(model_set.series), _values_beside_disturbance(base, location)
        )
        other = evaluate(base.candidate, model_set.series, base.noise_levels, point)
        model = other if other.cost < base.cost else base
        excess = regression_at(model_set, model, location.section, location.place)
        ranked = rank_terms(excess.problem, excess.columns)
        options += [(gain, location, excess, (one,)) for gain, one in ranked[:MAX_FITS]]
        chosen = select_terms(excess.problem, excess.columns, MAX_TERMS, MIN_SECOND_TERM_GAIN)
        if len(chosen) > 1:
            gains, pair = zip(*chosen, strict=True)
            options.append((sum(gains), location, excess, pair))
    options.sort(key=lambda option: -option[0])
    first = [max((o for o in options if o[1] is place), key=lambda o: o[0]) for place in places]
    best_options = [*first, *(option for option in options if option not in first)][:MAX_FITS]
    formulas = []
    for number, (gain, location, excess, columns) in enumerate(best_options, 1):
        if gain > 0.0:
            terms = [excess.terms[excess.columns.index(one)] for one in columns]
            values = coefficients_of(excess.problem, columns)
            with suppress(SpecError):
                formula = build_formula(
                    model_set, location.section, location.place, terms, values, number
                )
                formulas.append((formula, location))
    return formulas


def _values_beside_disturbance(base: Estimate, location: Location) -> dict[str, float]:
    """Return the parameters [SI] fitted beside the free disturbance of a location."""
    return (location.free_model or base).values(0)


def _fit_formula(
    model_set: ModelSet,
    compared: Round,
    formula: FormulaEffect,
    location: Location,
    starts: Sequence[Mapping[str, float]],
) -> DiscoveredEquation | None:
    """Return the formula fitted from the best of `starts` [SI]; None if invalid or diverged."""
    try:
        candidate = model_set.compile_candidate((formula.placed_effect,))
    except SpecError:
        return None
    base, starting_fits = compared.base, []
    for values in starts:
        point = vector_of(candidate, len(model_set.series), {**values, **formula.initial_values})
        own = point.per_recording.copy()
        for k, one in enumerate(candidate.free_parameters):
            if one.name in formula.phases:
                own[:, k] = [one.coordinate(value) for value in formula.phases[one.name]]
        point = ParameterVector(point.shared, own)
        starting_fits.append(evaluate(candidate, model_set.series, base.noise_levels, point))
    start = min(starting_fits, key=lambda one: one.cost).point
    estimate = estimate_parameters(candidate, model_set.series, base.noise_levels, start)
    if not np.isfinite(estimate.cost) or estimate.normal_equations is None:
        return None
    each = [estimate.values(k) for k in range(len(model_set.series))]
    text = formula.format_fitted(quantities_of(estimate), each)
    gain = effective_gain(estimate, base, compared.correlation, len(model_set.series))
    floor = np.minimum(compared.floor, least_variances([estimate]))
    share = explained_share(estimate, base, floor)
    return DiscoveredEquation(location, formula, estimate, gain, share, text)
