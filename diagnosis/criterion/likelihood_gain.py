"""Likelihood gain: the gain of a model over another one, penalised and cross-validated.

The cross-validation leaves out every fifth block in time of each recording. The parameters without
a block follow from one step of the normal equations (infinitesimal jackknife, Efron 1982).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.criterion.cross_validation import cross_validated_squares
from diagnosis.criterion.effective_sample_size import integrated_autocorrelation
from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate


@dataclass(frozen=True)
class LikelihoodGain:
    """Gains [nats]: `penalised` in training (BIC), `cross_validated` over all left-out blocks.

    `by_recording` (recordings,) are the parts of the cross-validated gain.
    """

    penalised: float
    cross_validated: float
    by_recording: tuple[float, ...]

    @property
    def smaller(self) -> float:
        """The smaller of both gains."""
        return min(self.penalised, self.cross_validated)

    @property
    def total(self) -> float:
        """The sum of both gains."""
        return self.penalised + self.cross_validated


def likelihood_gain(
    model: Estimate, base: Estimate, series: Sequence[SampledRecording]
) -> LikelihoodGain:
    """Return the gain of a model over a base that it extends; -inf for a model with infinite cost.

    Gains are divided by the integrated autocorrelation of the model's innovations. The penalty is
    log(n_eff) / 2 for each additional parameter; a parameter per recording counts once for each.
    """
    if not np.isfinite(model.cost):
        return LikelihoodGain(-np.inf, -np.inf, (-np.inf,) * len(series))
    effective_fraction = 1.0 / integrated_autocorrelation(model, series)
    count = float(np.sum(model.prediction.counts))
    extra_parameters = _parameter_count(model, len(series)) - _parameter_count(base, len(series))
    penalty = 0.5 * extra_parameters * np.log(max(count * effective_fraction, 2.0))
    train = effective_fraction * (base.cost - model.cost) - penalty
    before, after = cross_validated_squares(base, series), cross_validated_squares(model, series)
    each = effective_fraction * _gain_by_recording(before, after, model.prediction.counts)
    return LikelihoodGain(float(train), float(np.sum(each)), tuple(float(one) for one in each))


def subtract_gains(total: LikelihoodGain, parts: Sequence[LikelihoodGain]) -> LikelihoodGain:
    """Return the difference of a gain and other gains, component by component."""
    each = zip(total.by_recording, *(part.by_recording for part in parts), strict=True)
    return LikelihoodGain(
        total.penalised - sum(part.penalised for part in parts),
        total.cross_validated - sum(part.cross_validated for part in parts),
        tuple(first - sum(rest) for first, *rest in each),
    )


def add_gains(base_gain: LikelihoodGain, added_gain: LikelihoodGain) -> LikelihoodGain:
    """Return the sum of two gains, component by component."""
    each = zip(base_gain.by_recording, added_gain.by_recording, strict=True)
    total = tuple(first + second for first, second in each)
    return LikelihoodGain(
        base_gain.penalised + added_gain.penalised,
        base_gain.cross_validated + added_gain.cross_validated,
        total,
    )


def _parameter_count(model: Estimate, recordings: int) -> int:
    """Return the number of parameters of a model,
    those per recording counted for each recording.
    """
    return sum(recordings if one.per_recording else 1 for one in model.candidate.free_parameters)


def _gain_by_recording(before: Reals, after: Reals, counts: Reals) -> Reals:
    """Return the gain [nats] of each recording: its share of the sum of N/2 log of mean-square
    ratios.

    `before` and `after` are sums of squares (recordings, outputs). Each recording has the share
    that it has in the difference of the squares.
    """
    if not (np.all(np.isfinite(before)) and np.all(np.isfinite(after))):
        return np.full(len(before), np.inf if np.all(np.isfinite(after)) else -np.inf)
    first, second = before.sum(axis=0), after.sum(axis=0)
    apart = first - second
    ratio = np.log(first / second)
    weight = np.where(
        np.abs(ratio) > 1e-12, ratio / np.where(apart == 0.0, 1.0, apart), 1.0 / first
    )
    return np.asarray(0.5 * (before - after) @ (counts * weight), dtype=np.float64)
