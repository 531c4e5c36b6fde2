"""Candidate search: effects at places that predict the training recordings better than the base."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from diagnosis.criterion.effective_sample_size import integrated_autocorrelation
from diagnosis.criterion.likelihood_gain import LikelihoodGain, likelihood_gain
from diagnosis.criterion.recording_support import SINGLE_RECORDING_FACTOR, ranking_gain
from diagnosis.estimation.estimate import Estimate, evaluate_near
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import fit_candidate
from diagnosis.model.parameter_vector import extend_vector, vector_of
from diagnosis.model.placed_effect import PlacedEffect, effect_names, has_parameters
from diagnosis.selection.active_bound import active_bound_locations, release_active_bounds
from diagnosis.selection.screening import (
    MIN_SCREENING_GAIN,
    ScreeningResult,
    screen_candidates,
    start_values,
)

MAX_FITS, MAX_FITS_BESIDE = 7, 4
"""Candidates that are fitted to the end, best foreseen first: alone, and beside what was accepted,
where most of what the others promise is explained."""
MAX_RELEASED_FITS = 3
"""Candidates that are fitted beside accepted effects where these press a parameter of the base to
the end of its range: a friction that promised 25 nats gained 166 once the base was eased."""
MAX_AUTOCORRELATION = 2.0
"""Innovations that count as one, from which on a fit is no good."""
SUBSET_FRACTION = 0.1
"""Part of what a candidate has to promise that it gains on some recordings, to be seen on all."""
PRUNING_FRACTION = 0.25
"""A candidate that promises less than this part of what another has gained is not fitted."""
PARAMETER_PENALTY = 2.5
"""Nats that each number of an effect has to gain beyond its price."""
ENTRY_THRESHOLD = 10.0
"""A candidate that promises less [nats] is not fitted."""
LogCallback = Callable[[str], None]


@dataclass(frozen=True)
class CandidateFit:
    """A candidate with its screening gain [nats]; `estimate` and `likelihood_gain` if it was
    fitted.

    `lead` [nats] puts a restricted form before the full one; `joint_gain` is its gain beside all
    accepted effects, 0 if unknown.
    """

    placed_effect: PlacedEffect
    screening_gain: float
    estimate: Estimate | None = field(default=None, repr=False)
    likelihood_gain: LikelihoodGain | None = None
    lead: float = 0.0
    joint_gain: float = 0.0

    @property
    def shared_values(self) -> dict[str, float]:
        """The fitted values [SI] of the effect's shared parameters; empty if it was not fitted."""
        if self.estimate is None:
            return {}
        values, brought = self.estimate.values(0), effect_names(self.placed_effect)
        uncertain = self.estimate.candidate.free_parameters
        return {
            one.name: values[one.name]
            for one in uncertain
            if one.name in brought and not one.per_recording
        }

    @property
    def gain(self) -> float:
        """The gain [nats] at acceptance or beside the other effects, whichever is larger.

        The right effect may gain little while something else is missing.
        """
        return max(self.likelihood_gain.penalised if self.likelihood_gain else 0.0, self.joint_gain)

    @property
    def score(self) -> float:
        """The score [nats] for ranking: gains and lead, less a penalty for each parameter of the
        effect.

        An effect with more parameters also absorbs errors of a simpler form. The supported gain
        counts no more than the penalised one. A candidate that was not fitted ranks behind all
        others.
        """
        if self.likelihood_gain is None or self.estimate is None:
            return self.screening_gain - 1e6
        brought = effect_names(self.placed_effect).keys() & set(self.estimate.candidate.names)
        gained = ranking_gain(
            self.likelihood_gain,
            SINGLE_RECORDING_FACTOR if has_parameters(self.placed_effect) else 1.0,
        )
        return gained + self.lead - PARAMETER_PENALTY * len(brought)


def search_candidates(
    model_set: ModelSet,
    base: Estimate,
    units: Mapping[str, float],
    placed_effects: Iterable[PlacedEffect],
    log: LogCallback = lambda text: None,
    min_gain: float = ENTRY_THRESHOLD,
    fitted_before: Iterable[CandidateFit] = (),
) -> list[CandidateFit]:
    """Return the candidates beside the effects of the base, best first.

    Fits start also where candidates of `fitted_before` ended.
    """
    least = max(MIN_SCREENING_GAIN, SUBSET_FRACTION * min_gain)
    there = {placed_effect.id for placed_effect in base.candidate.placed_effects}
    new = [placed_effect for placed_effect in placed_effects if placed_effect.id not in there]
    made = model_set.try_compile_all(
        [[*base.candidate.placed_effects, placed_effect] for placed_effect in new]
    )
    known = [
        (placed_effect, one)
        for placed_effect, one in zip(new, made, strict=True)
        if one is not None
    ]
    found: list[CandidateFit] = []
    chances = _FitBudget(model_set, base, min_gain)
    fits = {one.placed_effect.id: one.shared_values for one in fitted_before if one.estimate}
    for promise in screen_candidates(model_set, base, known, least, fits):
        gain, placed_effect, start = (
            promise.gain,
            promise.placed_effect,
            chances.start(promise, found),
        )
        if start is None:
            found.append(CandidateFit(placed_effect, gain))
            continue
        given = (
            base.noise_levels,
            start.point,
            start.jacobian,
            start.gains,
            units,
            start.cost - ENTRY_THRESHOLD,
        )
        make = partial(_fit_screened, model_set, base, start, units)
        estimate = model_set.load_or_fit("fitted", start.candidate, given, make)
        if not np.isfinite(estimate.cost):
            found.append(CandidateFit(placed_effect, gain))
            continue
        gains = likelihood_gain(estimate, base, model_set.series)
        text = f"train {gains.penalised:.0f}, left out {gains.cross_validated:.0f} nats"
        log(f"{placed_effect.id}: {text}")
        found.append(CandidateFit(placed_effect, gain, estimate, gains))
    return sorted(found, key=lambda one: -one.score)


class _FitBudget:
    """Which candidates beside a base are fitted to the end: a few of those that promise what is
    worth it; beside accepted effects a few where the base is pressed, whatever they promise.
    """

    def __init__(self, model_set: ModelSet, base: Estimate, min_gain: float) -> None:
        """None of them is used yet."""
        is_beside = bool(base.candidate.placed_effects)
        self._bench, self._base, self._worth = model_set, base, min_gain
        self._left = MAX_FITS_BESIDE if is_beside else MAX_FITS
        self._eased = MAX_RELEASED_FITS if is_beside else 0
        self._pressed = active_bound_locations(base, model_set.automaton)

    def start(self, result: ScreeningResult, fitted: Sequence[CandidateFit]) -> Estimate | None:
        """Return where a fit of a candidate starts; None where it is not fitted."""
        best = max(
            (one.likelihood_gain.penalised for one in fitted if one.likelihood_gain), default=0.0
        )
        is_worth = result.gain >= max(self._worth, PRUNING_FRACTION * best)
        if result.start is not None and is_worth and self._left > 0:
            self._left -= 1
            return result.start
        if result.placed_effect.place in self._pressed and result.gain > 0.0 and self._eased > 0:
            self._eased -= 1
            return _start_with_released_bounds(self._bench, self._base, result.placed_effect)
        return None


def _start_with_released_bounds(
    model_set: ModelSet, base: Estimate, placed_effect: PlacedEffect
) -> Estimate | None:
    """Return a candidate where it starts, beside a base whose pressed parameters are declared."""
    candidate = model_set.try_compile([*base.candidate.placed_effects, placed_effect])
    if candidate is None:
        return None
    start = start_values(candidate, base.values(0))[0]
    point = extend_vector(
        candidate, base.candidate, release_active_bounds(base, model_set.automaton), start
    )
    return evaluate_near(candidate, model_set.series, base.noise_levels, point, base)


def _fit_screened(
    model_set: ModelSet, base: Estimate, start: Estimate, units: Mapping[str, float]
) -> Estimate:
    """Return a candidate fitted from where screening left it.

    Where that is no good it is fitted from where the base is declared as well: what lacks something
    may have led the base far astray.
    """
    candidate, known = start.candidate, start.cost - ENTRY_THRESHOLD
    given = model_set.series, base.noise_levels
    first = fit_candidate(candidate, *given, start.point, units, known, start.jacobian, start)
    if (
        not np.isfinite(first.cost)
        or integrated_autocorrelation(first, model_set.series) < MAX_AUTOCORRELATION
    ):
        return first
    point = vector_of(candidate, len(model_set.series), {})
    own = [k for k, name in enumerate(candidate.names) if name not in base.candidate.names]
    point.shared[own], point.per_recording[:, own] = (
        start.point.shared[own],
        start.point.per_recording[:, own],
    )
    again = fit_candidate(candidate, *given, point, units, first.cost)
    return min(first, again, key=lambda one: one.cost)
