"""Kalman gains: gains of an observer from the linearised candidate at its operating points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.data.stacked_recordings import burn_in_samples
from diagnosis.estimation.innovations import KalmanGains, NoiseLevels, PredictionResult
from diagnosis.estimation.linearisation import LinearModel
from diagnosis.estimation.operating_point import linearise_modes
from diagnosis.model.candidate import INITIAL_STD_FRACTION, Candidate

MIN_INTEGRATOR_EIGENVALUE = 0.999
"""Diagonal element of the transition matrix above which a state counts as an integrator."""
MODEL_NOISE_FRACTION = 1e-7
"""Process noise of every state per sample, as a fraction of its range; it keeps gains above 0."""


@dataclass(frozen=True)
class LocalModel:
    """A candidate in one mode near its operating point, linearised over one sample.

    `q` (states, states) is the process noise per sample, `initial_std` (states,) are the standard
    deviations of the states at the start, and `dwell_samples` is the median dwell time in the mode.
    """

    linear: LinearModel
    q: Reals
    initial_std: Reals
    dwell_samples: int


def kalman_gains(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    values: Mapping[str, float],
    noise_levels: NoiseLevels,
    prediction: PredictionResult | None = None,
) -> KalmanGains:
    """Return the Kalman gains of a candidate at `values` for the operating points of `prediction`.

    The mode with the longest stay has the steady-state gain, and its transient is used during the
    shortest burn-in of a recording. The gain of another mode is the one after its median dwell
    time, starting from the steady covariance: a short stay, as in a gap, does not reach a steady
    state. Modes without an operating point or a valid gain have the gain of the first mode that has
    one (0 if none has). Without `prediction` the only operating point is the start of one
    recording. With the output-error criterion the steady gains are 0, the transient is not.
    """
    count = min(burn_in_samples(one) for one in series)
    steady_by_mode: dict[int, Reals] = {}
    first = np.zeros((0, len(candidate.state_ranges), len(noise_levels.outputs)))
    covariance = np.zeros(0)
    for mode, local in local_models(candidate, series, values, noise_levels, prediction).items():
        model_terms = local.linear.phi, local.linear.c, local.q, noise_levels.outputs**2
        if steady_by_mode:
            gains = candidate.predictor.compute_gains(
                *model_terms, covariance, 0, local.dwell_samples
            )
        else:
            gains = candidate.predictor.compute_gains(
                *model_terms, np.diag(local.initial_std**2), count
            )
        if gains is not None:
            first, covariance = (first, covariance) if steady_by_mode else (gains[0], gains[2])
            steady_by_mode[mode] = gains[1]
    zero_gain = np.zeros((len(candidate.state_ranges), len(noise_levels.outputs)))
    default_gain = next(iter(steady_by_mode.values()), zero_gain)
    modes = candidate.predictor.modes
    steady = np.array(
        [
            zero_gain if noise_levels.is_output_error else steady_by_mode.get(mode, default_gain)
            for mode in modes
        ]
    )
    return KalmanGains(first, np.ascontiguousarray(steady)).scaled(noise_levels.gain_scale)


def local_models(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    values: Mapping[str, float],
    noise_levels: NoiseLevels,
    prediction: PredictionResult | None = None,
) -> dict[int, LocalModel]:
    """Return the linearised candidate in each mode of `prediction`, the longest stay first.

    The operating points are those of `linearise_modes`; modes without one, or with an invalid
    linearisation, are left out. The process noise has parts from the inputs, the disturbance states
    and, very small (`MODEL_NOISE_FRACTION`), every state but integrators that effects add. Delays
    are set to 0, because a delayed output would seem to contain no information on the states.
    """
    zero_delays = dict.fromkeys(candidate.compiled.delays, 0.0)
    page = candidate.calibration_page({**values, **zero_delays}, series[0])
    input_covariance, models = np.diag(noise_levels.inputs**2), {}
    disturbance_variances = _disturbance_variances(candidate, noise_levels, float(series[0].period))
    for mode, (linear, stay) in linearise_modes(candidate, series, page, prediction).items():
        uncertain_ranges = np.where(
            _is_effect_integrator(candidate, linear), 0.0, candidate.state_ranges
        )
        q = linear.b @ input_covariance @ linear.b.T + np.diag(
            (MODEL_NOISE_FRACTION * uncertain_ranges) ** 2
        )
        for place, variance in disturbance_variances.items():
            q[place, place] = variance
        initial_std = _initial_std(candidate, noise_levels, uncertain_ranges)
        models[mode] = LocalModel(linear, q, initial_std, stay)
    return models


def _initial_std(candidate: Candidate, noise_levels: NoiseLevels, ranges: Reals) -> Reals:
    """Return the standard deviations of the states at the start (states,).

    They are `INITIAL_STD_FRACTION` of the ranges, and of the standard deviations of disturbances.
    """
    sizes = ranges.copy()
    for name in candidate.disturbance_states:
        place = candidate.predictor.states.index(name)
        sizes[place] = noise_levels.process.get(name, sizes[place])
    return INITIAL_STD_FRACTION * sizes


def _is_effect_integrator(candidate: Candidate, linear: LinearModel) -> NDArray[np.bool_]:
    """Return the mask (states,) of integrators that effects add, such as an angle.

    Their influence on an output changes sign with the angle, so a gain at one angle would be wrong.
    """
    keeps = linear.phi.diagonal() > MIN_INTEGRATOR_EIGENVALUE
    return np.asarray(keeps & candidate.is_effect_state, dtype=np.bool_)


def _disturbance_variances(
    candidate: Candidate, noise_levels: NoiseLevels, period: float
) -> dict[int, float]:
    """Return the process-noise variance per sample of each disturbance state, by its index.

    For an Ornstein-Uhlenbeck process with standard deviation s it is s^2 (1 - exp(-2 T / memory)).
    """
    variances = {}
    for name, memory in zip(candidate.disturbance_states, candidate.compiled.memories, strict=True):
        decay = np.exp(-period / memory)
        place = candidate.predictor.states.index(name)
        variances[place] = noise_levels.process.get(name, 0.0) ** 2 * (1.0 - decay**2)
    return variances
