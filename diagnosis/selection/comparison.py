"""Comparison: base, effects and free disturbances, judged by one criterion (docs/method.md).

A round compares all candidates beside a base. Its best effect is accepted if it gains enough and
explains most of what any disturbance explains; the next round has the accepted effect in its base.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from diagnosis.criterion.effective_sample_size import integrated_autocorrelation
from diagnosis.criterion.explained_share import (
    explained_share,
    is_ordinary,
    least_share,
    least_variances,
    negligible_gain,
    remaining_energy,
    sampled_energy,
)
from diagnosis.criterion.threshold import DEFAULT_THRESHOLD
from diagnosis.data.array_types import Reals
from diagnosis.estimation.estimate import Estimate, with_best_gain_scale
from diagnosis.estimation.levenberg_marquardt import estimate_parameters
from diagnosis.estimation.model_set import ModelSet
from diagnosis.localisation.disturbance_state_fit import free_disturbance
from diagnosis.localisation.ranking import disturbance_locations
from diagnosis.model.parameter_vector import extend_vector
from diagnosis.model.placed_effect import PlacedEffect
from diagnosis.selection.candidate_search import CandidateFit, search_candidates
from diagnosis.selection.intersample import LogCallback
from diagnosis.selection.nested_form import choose_form

MIN_BASE_GAIN = DEFAULT_THRESHOLD
"""Gain [nats] for which the comparison is repeated with a better fit of the base."""


@dataclass(frozen=True)
class Round:
    """The candidates beside a base, the largest gain first, then those that were not fitted.

    `floor` (channels,) are the least mean-square innovations of all models of the round, `energy`
    is what the base leaves above them, and `sampled_energy` counts it for each independent sample.
    `free` are the fits of the base with a free disturbance, by place; `correlation` is the number
    of samples that count as one.
    """

    base: Estimate = field(repr=False)
    free: Mapping[str, Estimate] = field(repr=False)
    candidates: tuple[CandidateFit, ...]
    floor: Reals = field(repr=False)
    energy: float
    correlation: float
    sampled_energy: float

    @property
    def is_ordinary(self) -> bool:
        """Whether what the base leaves may be an ordinary disturbance."""
        return is_ordinary(self.energy, len(self.floor))

    @property
    def negligible_gain(self) -> float:
        """Gain [nats] of a model that explains a negligible energy."""
        return negligible_gain(float(np.sum(self.base.prediction.counts)) / self.correlation)

    def least_share_of(self, candidate: CandidateFit) -> float:
        """Return the share that an effect must explain to be as probable as what is unknown.

        If what the base leaves may be an ordinary disturbance, it is that without noise.
        """
        energy = math.inf if self.is_ordinary else self.sampled_energy
        return least_share(energy, candidate.parameter_count)

    def is_explained_by(self, candidate: CandidateFit) -> bool:
        """Return whether an effect explains the least share."""
        return candidate.share >= self.least_share_of(candidate)


def compare_candidates(
    model_set: ModelSet,
    base: Estimate,
    placed_effects: Iterable[PlacedEffect],
    log: LogCallback = lambda text: None,
    least_energy: float = 0.0,
) -> Round:
    """Return the comparison of effects beside a base.

    A free disturbance or a candidate contains the base, so its fit can show that the fit of the
    base ended in a local minimum. The base is then fitted again from the parameters of the best
    one. If a candidate shows it, the comparison is repeated. No candidate is fitted if the base
    leaves less than `least_energy` above its floor. A base that is fitted by simulation has no free
    disturbance, so its effects are compared with each other. Whether it leaves `least_energy` is
    measured above the noise of the signals.
    """
    effects = tuple(placed_effects)
    free = _free_disturbances(model_set, base)
    better = _fit_base_again(model_set, base, free.values(), log)
    if better is not None:
        base, free = better, _free_disturbances(model_set, better)
    compared = _compare(model_set, base, free, effects, log, least_energy)
    fits = [one.estimate for one in compared.candidates if one.estimate is not None]
    better = _fit_base_again(model_set, base, fits, log)
    if better is None:
        return compared
    free = _free_disturbances(model_set, better)
    return _compare(model_set, better, free, effects, log, least_energy)


def _fit_base_again(
    model_set: ModelSet, base: Estimate, models: Iterable[Estimate], log: LogCallback
) -> Estimate | None:
    """Return the base fitted from the parameters of the best of some models that contain it.

    It is None if that does not gain `MIN_BASE_GAIN` (20 nats).
    """
    series = model_set.series
    best = min([base, *models], key=lambda one: one.cost)
    correlation = integrated_autocorrelation(best, series)
    if (base.cost - best.cost) / correlation < MIN_BASE_GAIN:
        return None
    start = extend_vector(base.candidate, best.candidate, best.point, {})
    fit = partial(estimate_parameters, base.candidate, series, base.noise_levels, start)
    fitted = model_set.load_or_fit("base again", base.candidate, [start, base.noise_levels], fit)
    again = with_best_gain_scale(fitted, series)
    if (base.cost - again.cost) / correlation < MIN_BASE_GAIN:
        return None
    log(f"the base is fitted again: {base.cost - again.cost:.0f} nats")
    return again


def _free_disturbances(model_set: ModelSet, base: Estimate) -> dict[str, Estimate]:
    """Return the fits of the base with a free disturbance, by place."""
    is_simulated = base.noise_levels.is_output_error
    places = () if is_simulated else disturbance_locations(model_set, base)
    return {
        f"{section}.{one.place}": free_disturbance(model_set, base, one) for section, one in places
    }


def _compare(
    model_set: ModelSet,
    base: Estimate,
    free: Mapping[str, Estimate],
    placed_effects: tuple[PlacedEffect, ...],
    log: LogCallback,
    least_energy: float,
) -> Round:
    """Return the comparison with the base and its free disturbances as they are fitted."""
    flexible = min(free.values(), key=lambda one: one.cost, default=base)
    start = extend_vector(base.candidate, flexible.candidate, flexible.point, {})
    floor = least_variances([base, *free.values()])
    if base.noise_levels.is_output_error:
        floor = np.minimum(floor, base.noise_levels.outputs**2)
    if remaining_energy(base, floor) < least_energy:
        placed_effects = ()
    found = search_candidates(model_set, base, placed_effects, start, log)
    return judge(model_set, base, free, found)


def judge(
    model_set: ModelSet,
    base: Estimate,
    free: Mapping[str, Estimate],
    found: Iterable[CandidateFit],
) -> Round:
    """Return the comparison of fitted candidates with a base and its free disturbances."""
    found = list(found)
    fits = [one.estimate for one in found if one.estimate is not None]
    floor = least_variances([base, *free.values(), *fits])
    best = min([base, *fits], key=lambda one: one.cost)
    correlation = integrated_autocorrelation(best, model_set.series)
    count = len(model_set.series)
    judged = [_judge_candidate(one, base, floor, correlation, count) for one in found]
    judged.sort(key=lambda one: -one.gain)
    energy = remaining_energy(base, floor)
    sampled = sampled_energy(base, floor, correlation)
    return Round(base, free, tuple(judged), floor, energy, correlation, sampled)


def _judge_candidate(
    one: CandidateFit, base: Estimate, floor: Reals, correlation: float, recordings: int
) -> CandidateFit:
    """Return a candidate with its gain, its share and its form; one without a fit is unchanged."""
    model = one.estimate
    if model is None:
        return one
    return replace(
        one,
        gain=effective_gain(model, base, correlation, recordings),
        share=explained_share(model, base, floor),
        form=choose_form(model, correlation, parameter_price(model, correlation)),
    )


def parameter_price(model: Estimate, correlation: float) -> float:
    """Return the price [nats] of a parameter: log(n) / 2 for n effective samples (Schwarz 1978)."""
    return math.log(max(float(np.sum(model.prediction.counts)) / correlation, 2.0)) / 2.0


def effective_gain(model: Estimate, base: Estimate, correlation: float, recordings: int) -> float:
    """Return the gain [nats] of a model over a base, less the price of its additional parameters.

    `correlation` is the number of samples that count as one. A parameter per recording has its
    price for each recording. Both models have the nested form of least cost.
    """
    price = parameter_price(model, correlation)
    before, after = (_cost_with_price(one, correlation, recordings, price) for one in (base, model))
    return before - after


def _cost_with_price(model: Estimate, correlation: float, recordings: int, price: float) -> float:
    """Return the cost [nats] of the best form of a model, with the price of its parameters."""
    form = choose_form(model, correlation, price)
    count = _parameter_count(model, recordings) - len(form.fixed)
    return (model.cost + form.added_cost) / correlation + count * price


def _parameter_count(model: Estimate, recordings: int) -> int:
    """Return the number of parameters, those per recording counted for each recording."""
    return sum(recordings if one.per_recording else 1 for one in model.candidate.free_parameters)
