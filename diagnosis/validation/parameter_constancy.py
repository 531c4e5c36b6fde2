"""Parameter constancy: whether the parameters of an effect are equal in all recordings.

A physical constant of a machine does not depend on the manoeuvre. An effect that imitates another
one, which the library lacks, has another best value in each recording.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.criterion.cross_validation import STEP_FRACTIONS
from diagnosis.criterion.effective_sample_size import integrated_autocorrelation
from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.innovations import PredictionResult, predict
from diagnosis.model.parameter_vector import bounds_of
from diagnosis.model.placed_effect import TIME_DIMENSION, PlacedEffect, effect_names
from diagnosis.selection.candidate_search import CandidateFit
from language.expressions.units import parse_unit
from language.text.document import MappingNode, ScalarNode

Integers = NDArray[np.int64]
VARIATION_GAIN, VARIATION_FRACTION = 20.0, 0.012
"""Gain [nats] of separate values, and its fraction of the effect's gain, above which they vary."""
REJECTION_FRACTION, DELAY_REJECTION_FRACTION = 0.2, 0.06
"""Fraction of the effect's gain above which the effect is rejected, in general and for a delay
alone.

Right effects have 0.17 at most. A single lag or delay has 0.01 (two of fifty 0.03 and 0.05),
because no other effect changes its time.
"""


def rejects_constancy(
    model: Estimate,
    candidate_fit: CandidateFit,
    series: Sequence[SampledRecording],
    is_only_effect: bool,
) -> bool:
    """Return whether an effect is rejected because its parameters differ between recordings.

    The gain [nats] of separate parameter values for each recording, both predicted and simulated,
    must exceed the larger of `VARIATION_GAIN` (20) and a fraction of the effect's gain:
    `DELAY_REJECTION_FRACTION` (0.06) for a lag or delay that is the only accepted effect
    (`is_only_effect`), else `REJECTION_FRACTION` (0.2).
    """
    part = (
        DELAY_REJECTION_FRACTION
        if is_only_effect and is_lag_or_delay(candidate_fit.placed_effect)
        else REJECTION_FRACTION
    )
    most = max(VARIATION_GAIN, part * candidate_fit.gain)
    if not heterogeneity_score(model, candidate_fit.placed_effect, series) > most:
        return False
    return simulated_heterogeneity(model, candidate_fit.placed_effect, series) > most


def is_lag_or_delay(placed_effect: PlacedEffect) -> bool:
    """Return whether an effect has a parameter that is a time and has `neutral: absent`.

    The unit of its declared value must have the dimension of a time.
    """
    known = placed_effect.effect.body.get("parameters")
    entries = known if isinstance(known, MappingNode) else ()
    return any(
        isinstance(one.node, MappingNode) and _is_time_with_absent_neutral(one.node)
        for one in entries
    )


def _is_time_with_absent_neutral(parameter: MappingNode) -> bool:
    """Return whether a declared parameter is a time with `neutral: absent`."""
    neutral, value = parameter.get("neutral"), parameter.get("value")
    if (
        not isinstance(neutral, ScalarNode)
        or not isinstance(value, ScalarNode)
        or neutral.text != "absent"
    ):
        return False
    unit = value.text.partition(" ")[2]
    return bool(unit) and parse_unit(unit).dimension.powers == TIME_DIMENSION


def has_varying_parameters(
    model: Estimate, candidate_fit: CandidateFit, series: Sequence[SampledRecording]
) -> bool:
    """Return whether the parameters of an effect vary between recordings.

    The predicted gain of separate values (`heterogeneity_score`) must exceed the larger of
    `VARIATION_GAIN` (20 nats) and `VARIATION_FRACTION` (0.012) of the effect's gain.
    """
    return heterogeneity_score(model, candidate_fit.placed_effect, series) > max(
        VARIATION_GAIN, VARIATION_FRACTION * candidate_fit.gain
    )


def heterogeneity_score(
    model: Estimate, placed_effect: PlacedEffect, series: Sequence[SampledRecording]
) -> float:
    """Return the predicted gain [nats] of separate parameter values beyond the gain from noise.

    This is the score test (Rao 1948) of equal against separate values of the effect's shared
    parameters, all else fixed; it can be negative. The result is 0 without normal equations.
    """
    steps = _recording_steps(model, placed_effect, series)
    return sum(step.predicted_gain - step.expected_gain for step in steps)


def simulated_heterogeneity(
    model: Estimate, placed_effect: PlacedEffect, series: Sequence[SampledRecording]
) -> float:
    """Return the gain [nats] of separate values in predictions, beyond the gain from noise.

    Each recording takes the best of the steps of `heterogeneity_score`, shortened by
    `STEP_FRACTIONS`, or no step. The result is 0 without normal equations and can be negative.
    """
    steps = _recording_steps(model, placed_effect, series)
    if not steps:
        return 0.0
    effective_fraction = 1.0 / integrated_autocorrelation(model, series)
    before, best = _recording_costs(model, model.prediction), np.zeros(len(steps))
    for part in STEP_FRACTIONS:
        moved = [step.point_at(part) for step in steps]
        values = [step.values(model, z) for step, z in zip(steps, moved, strict=True)]
        run = predict(model.candidate, series, values, model.gains, model.noise_levels.huber_limits)
        distance = np.array(
            [0.5 * float(np.sum((z - s.start) ** 2)) for s, z in zip(steps, moved, strict=True)]
        )
        best = np.maximum(
            best, effective_fraction * (before - _recording_costs(model, run)) - distance
        )
    return float(np.sum(best)) - sum(step.expected_gain for step in steps)


@dataclass(frozen=True)
class _RecordingStep:
    """The step of an effect's parameters (`indices` of a model) in one recording.

    It begins at the shared coordinates `start`. `predicted_gain` [nats] follows from the normal
    equations, `expected_gain` is the mean gain that noise causes.
    """

    recording: int
    indices: Integers
    start: Reals
    step: Reals
    predicted_gain: float
    expected_gain: float
    bounds: Reals

    def point_at(self, part: float) -> Reals:
        """Return the coordinates after a fraction of the step, within the ranges (parameters,)."""
        low, high = self.bounds
        return np.clip(self.start + part * self.step, low, high)

    def values(self, model: Estimate, z: Reals) -> dict[str, float]:
        """Return the values [SI] of the recording with
        the effect's parameters at coordinates `z`.
        """
        known = [model.candidate.free_parameters[k] for k in self.indices]
        own = {one.name: one.value(float(at)) for one, at in zip(known, z, strict=True)}
        return {**model.values(self.recording), **own}


def _recording_steps(
    model: Estimate, placed_effect: PlacedEffect, series: Sequence[SampledRecording]
) -> list[_RecordingStep]:
    """Return the Gauss-Newton step of an effect's shared parameters in each recording.

    The list is empty without normal equations.
    """
    if model.normal_equations is None:
        return []
    added_names = effect_names(placed_effect)
    is_added = np.array([name in added_names for name in model.candidate.names], dtype=bool)
    indices = np.flatnonzero(is_added & ~model.normal_equations.own)
    effective_fraction, steps = 1.0 / integrated_autocorrelation(model, series), []
    at, bounds = model.point.shared[indices], bounds_of(model.candidate)[indices].T
    for recording in np.unique(model.normal_equations.of).tolist():
        is_recording = model.normal_equations.of == recording
        known = (
            effective_fraction
            * model.normal_equations.a[is_recording].sum(axis=0)[np.ix_(indices, indices)]
        )
        slope = effective_fraction * model.normal_equations.g[is_recording].sum(axis=0)[indices]
        whole = known + np.eye(len(indices))
        by_chance = 0.5 * float(np.trace(np.linalg.solve(whole, known)))
        step = -np.linalg.solve(whole, slope)
        gain = -0.5 * float(slope @ step)
        steps.append(_RecordingStep(recording, indices, at, step, gain, by_chance, bounds))
    return steps


def _recording_costs(model: Estimate, prediction: PredictionResult) -> Reals:
    """Return half the normalised squares of each recording (recordings,),
    infinite if it diverges.
    """
    costs = 0.5 * np.sum(prediction.runs.squared_sums / model.prediction.variances, axis=1)
    return np.where(prediction.runs.completed == np.diff(prediction.runs.starts), costs, np.inf)
