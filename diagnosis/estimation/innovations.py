"""Innovations: one-step prediction of recordings by a candidate with its own observer.

The model is in innovations form (Ljung 1999, section 7.4). The observer gain is computed from the
candidate itself, so a wrong model cannot use the gain of another one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from codegen.predictor.predictor import Predictor
from codegen.predictor.predictor_arrays import Prediction, StackedPrediction, StackedRecordings
from diagnosis.data.array_types import Reals
from diagnosis.data.noise_estimate import MAD_TO_STD
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.data.stacked_recordings import stack_recordings
from diagnosis.model.candidate import Candidate

MIN_RELATIVE_NOISE = 1e-6
"""Least noise of an output relative to its largest magnitude."""
MIN_NOISE = 1e-12
"""Noise [SI] of an output that is always 0."""


@dataclass(frozen=True)
class NoiseLevels:
    """Noise standard deviations [SI] of outputs (outputs,), inputs (inputs,) and disturbance
    states.

    Innovations beyond `huber_limits` (outputs,) count linearly instead of quadratically (Huber
    1964), so that an event predicted one sample late does not dominate. With `is_output_error` the
    states are not corrected after the burn-in, so innovations are the errors of a simulation. The
    Kalman gains that follow from the levels are multiplied by `gain_scale`.
    """

    outputs: Reals
    inputs: Reals
    process: Mapping[str, float]
    huber_limits: Reals
    is_output_error: bool = False
    gain_scale: float = 1.0


@dataclass(frozen=True)
class KalmanGains:
    """Kalman gains at one point: `transient` (samples, states, outputs), `steady_state` by mode.

    `steady_state` has the shape (modes, states, outputs).
    """

    transient: Reals
    steady_state: Reals

    def scaled(self, factor: float) -> KalmanGains:
        """Return the gains times a factor; 0 gives a simulation."""
        return KalmanGains(factor * self.transient, factor * self.steady_state)


@dataclass(frozen=True)
class PredictionResult:
    """The prediction of recordings: `runs`, and the number of `burn_in` samples of each recording.

    Innovations beyond `huber_limits` (outputs,) count linearly. `is_complete` is False if a run
    diverged.
    """

    runs: StackedPrediction = field(repr=False)
    burn_in: NDArray[np.int64] = field(repr=False)
    huber_limits: Reals = field(repr=False)
    is_complete: bool = True

    @cached_property
    def predictions(self) -> tuple[Prediction, ...]:
        """The prediction of each recording."""
        return self.runs.split()

    @cached_property
    def stacked(self) -> Reals:
        """The innovations of all recordings after the burn-in, concatenated (n, outputs)."""
        return _stack_after_burn_in(self.runs.stacked.innovations, self.runs.starts, self.burn_in)

    @cached_property
    def slices(self) -> list[slice]:
        """The slice of each recording in `stacked`; empty for one not longer than its burn-in."""
        return [slice(low, high) for low, high in pairwise(self._edges)]

    @property
    def innovations(self) -> tuple[Reals, ...]:
        """The innovations of each recording after its burn-in, (samples, outputs) each."""
        return tuple(self.stacked[part] for part in self.slices)

    @property
    def _edges(self) -> tuple[int, ...]:
        """The start of each recording in the stacked innovations, and the end of the last one."""
        starts = self.runs.starts
        lengths = np.maximum(starts[1:] - starts[:-1] - self.burn_in, 0)
        return 0, *np.cumsum(lengths).tolist()

    def negative_log_likelihood(self) -> float:
        """Return the concentrated negative log-likelihood [nats], infinite for an incomplete run.

        It is the sum over outputs of N/2 log(mean robust square innovation), after the burn-in.
        """
        if not self.is_complete:
            return np.inf
        return float((0.5 * self.counts * np.log(self.variances)).sum())

    def robust_std(self) -> Reals:
        """Return 1.4826 times the median magnitude of the innovations of each output (outputs,).

        This is the standard deviation of normal innovations. NaN is ignored.
        """
        return MAD_TO_STD * np.nanmedian(np.abs(self.stacked), axis=0)

    @cached_property
    def counts(self) -> Reals:
        """The number of known (not NaN) innovations of each output after the burn-in (outputs,)."""
        return np.asarray(self.runs.counts.sum(axis=0), dtype=np.float64)

    @cached_property
    def variances(self) -> Reals:
        """The mean robust square innovation of each output (outputs,), over all recordings.

        It is at least 1e-300, also for an output without a known innovation.
        """
        squares = self.runs.squared_sums.sum(axis=0)
        found: Reals = np.maximum(squares / np.maximum(self.counts, 1.0), 1e-300)
        return found


@dataclass(frozen=True)
class Innovations:
    """The innovations of recordings at a point: `values` (samples, outputs), burn-in included.

    `done` (recordings,) is the number of samples of each recording before a run diverged.
    """

    values: Reals
    done: NDArray[np.int64]
    recorded: StackedRecordings
    huber_limits: Reals
    predictor: Predictor

    @cached_property
    def stacked(self) -> Reals:
        """The innovations after the burn-in of each recording, concatenated (n, outputs)."""
        return _stack_after_burn_in(self.values, self.recorded.starts, self.recorded.burn_in)

    @property
    def by_recording(self) -> tuple[Reals, ...]:
        """The innovations of each recording after its burn-in, (samples, outputs) each."""
        return tuple(_split_after_burn_in(self.values, self.recorded.starts, self.recorded.burn_in))

    @property
    def robust_square_sums(self) -> Reals:
        """The sums of known robust squares after the burn-in (recordings, outputs)."""
        return self._sums[0]

    @property
    def counts(self) -> Reals:
        """The number of known innovations after the burn-in (recordings, outputs)."""
        return self._sums[1]

    @cached_property
    def _sums(self) -> tuple[Reals, Reals]:
        """The sums of the robust squares and the numbers of innovations (recordings, outputs)."""
        return self.predictor.sum_squares(self.values, self.recorded, self.huber_limits)


def measured_noise_levels(
    series: Sequence[SampledRecording], process: Mapping[str, float]
) -> NoiseLevels:
    """Return the noise levels of outputs and inputs: the medians over the recordings' `noise`.

    The noise of an output is at least a millionth of its largest magnitude (the median over
    recordings), and 1e-12 [SI] for an output that is always 0. `process` gives the levels of the
    disturbance states; the Huber limits are infinite.
    """
    output_noise, inputs = [np.array([one.noise[k] for one in series]) for k in (0, 1)]
    largest = np.median([one.largest_measured for one in series], axis=0)
    floor = np.where(largest > 0.0, MIN_RELATIVE_NOISE * largest, MIN_NOISE)
    outputs = np.maximum(np.median(output_noise, axis=0), floor)
    return NoiseLevels(outputs, np.median(inputs, axis=0), process, np.full(len(outputs), np.inf))


def predict(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    values: Sequence[Mapping[str, float]],
    gains: KalmanGains,
    huber_limits: Reals,
) -> PredictionResult:
    """Return the prediction of recordings, each with its own parameter values [SI].

    `values` has one mapping for each recording; a parameter that it does not name has its declared
    value. A run that diverges gives an incomplete result, not an error.
    """
    stacked = stack_recordings(series)
    recorded = stacked.recorded
    runs = candidate.predictor.predict_recordings(
        candidate.calibration_pages(values, stacked.first_measured),
        recorded,
        gains.transient,
        gains.steady_state,
        candidate.compiled.substeps,
        huber_limits,
    )
    is_complete = bool(np.all(runs.completed == recorded.starts[1:] - recorded.starts[:-1]))
    return PredictionResult(runs, recorded.burn_in, huber_limits, is_complete)


def predict_at_points(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    values: Sequence[Sequence[Mapping[str, float]]],
    gains: KalmanGains,
    huber_limits: Reals,
) -> list[Innovations]:
    """Return the innovations of recordings at several points: `values[point][recording]` [SI].

    They are in the order of the points, all with the same gains. The points run in parallel SIMD
    lanes; states are not stored.
    """
    stacked = stack_recordings(series)
    recorded, predictor = stacked.recorded, candidate.predictor
    runs = predictor.predict_points(
        np.array([candidate.calibration_pages(one, stacked.first_measured) for one in values]),
        recorded,
        gains.transient,
        gains.steady_state,
        candidate.compiled.substeps,
    )
    return [Innovations(*run, recorded, huber_limits, predictor) for run in zip(*runs, strict=True)]


def _stack_after_burn_in(
    innovations: Reals, starts: NDArray[np.int64], burn_in: NDArray[np.int64]
) -> Reals:
    """Return the innovations of all recordings after their burn-in, concatenated (n, outputs)."""
    return np.concatenate(_split_after_burn_in(innovations, starts, burn_in))


def _split_after_burn_in(
    innovations: Reals, starts: NDArray[np.int64], burn_in: NDArray[np.int64]
) -> list[Reals]:
    """Return the innovations of each recording after its burn-in, (samples, outputs) each."""
    edges = zip((starts[:-1] + burn_in).tolist(), starts[1:].tolist(), strict=True)
    return [innovations[low:high] for low, high in edges]
