"""Candidate search: every effect at every place, fitted beside a base."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from diagnosis.criterion.effective_sample_size import integrated_autocorrelation
from diagnosis.estimation.estimate import (
    Estimate,
    evaluate,
    with_best_gain_scale,
    with_normal_equations,
)
from diagnosis.estimation.levenberg_marquardt import iterate, refine
from diagnosis.estimation.model_set import ModelSet
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import ParameterVector, extend_vector, vector_of
from diagnosis.model.placed_effect import PlacedEffect, effect_names
from diagnosis.selection.intersample import LogCallback
from diagnosis.selection.nested_form import GENERAL_FORM, NestedForm
from diagnosis.selection.screening import screen_candidate

MIN_SCREENING_GAIN = 2.0
"""Gain [nats] of a few steps from which a candidate is fitted fully."""
MAX_FITS_BESIDE = 8
"""Candidates that are fitted fully beside accepted effects, those of largest screening gain."""
MAX_AUTOCORRELATION = 2.0
"""Integrated autocorrelation of the innovations above which a fit is repeated from other starts."""


@dataclass(frozen=True)
class CandidateFit:
    """An effect at a place, with its screening gain [nats], and its fit if it was fitted.

    `gain` [nats] is relative to the base of the comparison, divided by the integrated
    autocorrelation and less the price of the parameters. `share` is the explained share. `form` is
    the nested form of the effect for which both hold.
    """

    placed_effect: PlacedEffect
    screening_gain: float
    estimate: Estimate | None = field(default=None, repr=False)
    gain: float = -math.inf
    share: float = 0.0
    form: NestedForm = GENERAL_FORM

    @property
    def is_fitted(self) -> bool:
        """Whether the candidate was fitted."""
        return self.estimate is not None

    @property
    def parameter_count(self) -> int:
        """The number of parameters of the form of the effect; 0 without a fit."""
        if self.estimate is None:
            return 0
        own = effect_names(self.placed_effect)
        names = self.estimate.candidate.names
        return sum(name in own and name not in self.form.fixed for name in names)

    @property
    def cost(self) -> float:
        """The cost [nats] of the fit; infinite without one."""
        return math.inf if self.estimate is None else self.estimate.cost


def search_candidates(
    model_set: ModelSet,
    base: Estimate,
    placed_effects: Iterable[PlacedEffect],
    flexible: ParameterVector,
    log: LogCallback = lambda text: None,
) -> list[CandidateFit]:
    """Return the candidates beside the effects of the base, the least cost first.

    Effects that the base has, and those that cannot be combined with it, are left out. A candidate
    is fitted fully if its screening gains `MIN_SCREENING_GAIN` (2 nats); beside accepted effects
    these are at most `MAX_FITS_BESIDE` (8). The others follow by descending screening gain.
    `flexible` is the vector of the base with a free disturbance, from which a poor fit is repeated.
    Noise levels are those of the screening.
    """
    present = {one.id for one in base.candidate.placed_effects}
    new = [one for one in placed_effects if one.id not in present]
    compiled = model_set.try_compile_all([[*base.candidate.placed_effects, one] for one in new])
    pairs = [(one, candidate) for one, candidate in zip(new, compiled, strict=True) if candidate]
    screenings = [(one, screen_candidate(model_set, base, candidate)) for one, candidate in pairs]
    screenings.sort(key=lambda pair: pair[1].cost)
    count = MAX_FITS_BESIDE if base.candidate.placed_effects else len(screenings)
    found = []
    for rank, (placed_effect, screened) in enumerate(screenings):
        candidate, estimate = screened.candidate, None
        gain = base.cost - with_best_gain_scale(screened, model_set.series).cost
        if gain >= MIN_SCREENING_GAIN and rank < count:
            fit = partial(_fit_fully, model_set, base, screened, flexible)
            given = [screened.point, screened.noise_levels, screened.gains, base.point, flexible]
            fitted = model_set.load_or_fit("fitted", candidate, given, fit)
            if np.isfinite(fitted.cost):
                estimate = with_best_gain_scale(fitted, model_set.series)
        if estimate is not None:
            log(f"{placed_effect.id}: {base.cost - estimate.cost:.0f} nats")
        found.append(CandidateFit(placed_effect, gain, estimate))
    return sorted(found, key=lambda one: (one.cost, -one.screening_gain))


def _fit_fully(
    model_set: ModelSet, base: Estimate, screened: Estimate, flexible: ParameterVector
) -> Estimate:
    """Return the converged fit of a candidate from where screening left it.

    If its innovations are correlated, the better of two other starts is tried as well: the declared
    parameters and the flexible ones, with the effect's parameters of the screening. The fit of a
    deficient base may be far from the true parameters.
    """
    candidate, series, noise_levels = screened.candidate, model_set.series, screened.noise_levels
    jacobian = screened.jacobian or None
    first = refine(
        iterate(
            candidate, series, noise_levels, screened.point, jacobian=jacobian, nearby=screened
        ),
        series,
    )
    if first.cost > screened.cost:
        first = with_normal_equations(replace(screened, exhausted_jacobian=None), series)
    if integrated_autocorrelation(first, series) < MAX_AUTOCORRELATION:
        return first
    starts = [
        evaluate(candidate, series, noise_levels, point)
        for point in _other_starts(candidate, base, screened, flexible, len(series))
    ]
    best = min(starts, key=lambda one: one.cost)
    again = refine(iterate(candidate, series, noise_levels, best.point), series)
    return min(first, again, key=lambda one: one.cost)


def _other_starts(
    candidate: Candidate,
    base: Estimate,
    screened: Estimate,
    flexible: ParameterVector,
    recordings: int,
) -> list[ParameterVector]:
    """Return the declared and the flexible vector with the effect's parameters of the screening."""
    own = [k for k, name in enumerate(candidate.names) if name not in base.candidate.names]
    starts = [
        vector_of(candidate, recordings, {}),
        extend_vector(candidate, base.candidate, flexible, {}),
    ]
    for point in starts:
        point.shared[own] = screened.point.shared[own]
        point.per_recording[:, own] = screened.point.per_recording[:, own]
    return starts
