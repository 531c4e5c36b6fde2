"""Prediction: how well a candidate foresees recordings, one sample ahead, by its observer.

Innovations form (Ljung 1999, section 7.4): the observer's gain is recomputed from the candidate
itself, so a wrong model cannot hide behind the gain of another one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from codegen.predictor.predictions import Prediction, StackedPrediction, StackedRecordings
from codegen.predictor.predictor import Predictor
from diagnosis.data.noise_estimate import MAD_TO_STD
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.data.stacked_recordings import stack_recordings
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import ParameterVector, values_at

Reals = NDArray[np.float64]
PROCESS_NOISE_NAME, OUTPUT_NOISE_NAME, INPUT_NOISE_NAME = (
    "level of {}",
    "noise of {}",
    "noise of inputs",
)
"""Names of levels that a fit moves: of a drift, of a compared signal, of all inputs."""
FOLDS = 5
"""Parts of the recordings that are left out in turn: every fifth block in time of each."""


@dataclass(frozen=True)
class NoiseLevels:
    """What is known of noise: of the `seen` signals, of the inputs, and of each drift [SI].

    Innovations beyond `limits` (seen,) count in proportion, not as squares: an event that is
    foreseen a sample late must not outweigh all others. With `is_alone` nothing is corrected once
    the states have been found: an innovation is then what a simulation misses.
    """

    outputs: Reals
    inputs: Reals
    process: Mapping[str, float]
    huber_limits: Reals
    is_output_error: bool = False


@dataclass(frozen=True)
class KalmanGains:
    """The gains of one candidate at one point: `first` (count, states, seen), `steady` by mode."""

    transient: Reals
    steady_state: Reals


@dataclass(frozen=True)
class FoldBlock:
    """A `part` of the joined innovations, of a `recording`; left out with others of its `fold`."""

    recording: int
    fold: int
    part: slice


@dataclass(frozen=True)
class PredictionResult:
    """How recordings were foreseen: their `runs`, of which the samples `skips` do not count.

    Innovations beyond `limits` (seen,) count in proportion. `is_whole` where no run left all
    bounds.
    """

    runs: StackedPrediction = field(repr=False)
    burn_in: NDArray[np.int64] = field(repr=False)
    huber_limits: Reals = field(repr=False)
    is_complete: bool = True

    @cached_property
    def predictions(self) -> tuple[Prediction, ...]:
        """The run of each recording."""
        return self.runs.split()

    @cached_property
    def stacked(self) -> Reals:
        """The innovations of all recordings behind their burn-in, one after the other (n, seen)."""
        return _stack_after_burn_in(self.runs.stacked.innovations, self.runs.starts, self.burn_in)

    @cached_property
    def slices(self) -> list[slice]:
        """Where the innovations of each recording are among the joined ones."""
        return [slice(low, high) for low, high in pairwise(self._edges)]

    @property
    def innovations(self) -> tuple[Reals, ...]:
        """The innovations of each recording behind its burn-in, (samples, seen) each."""
        return tuple(self.stacked[part] for part in self.slices)

    @cached_property
    def blocks(self) -> list[FoldBlock]:
        """The recordings, each cut into `FOLDS` blocks."""
        return _fold_blocks(self._edges)

    @property
    def _edges(self) -> tuple[int, ...]:
        """Where each recording begins among the joined innovations, and where the last one ends."""
        starts = self.runs.starts
        lengths = np.maximum(starts[1:] - starts[:-1] - self.burn_in, 0)
        return 0, *np.cumsum(lengths).tolist()

    def negative_log_likelihood(self) -> float:
        """Return sum over channels of N/2 log(mean square), the negative log likelihood [nats]."""
        if not self.is_complete:
            return np.inf
        return float((0.5 * self.counts * np.log(self.variances)).sum())

    @cached_property
    def robust_squares(self) -> Reals:
        """The joined squares that count (Huber 1964), (n, seen)."""
        size = np.abs(self.stacked)
        near = np.minimum(size, self.huber_limits)
        return np.asarray(near * (2.0 * size - near), dtype=np.float64)

    def robust_std(self) -> Reals:
        """Return the standard deviation of the innovations by their median (seen,)."""
        return MAD_TO_STD * np.nanmedian(np.abs(self.stacked), axis=0)

    @cached_property
    def counts(self) -> Reals:
        """How many innovations each channel has (seen,)."""
        return np.asarray(self.runs.counts.sum(axis=0), dtype=np.float64)

    @cached_property
    def variances(self) -> Reals:
        """The mean square innovation of each channel (seen,)."""
        squares = self.runs.squared_sums.sum(axis=0)
        found: Reals = np.maximum(squares / np.maximum(self.counts, 1.0), 1e-300)
        return found


@dataclass(frozen=True)
class Innovations:
    """What was not foreseen of recordings at a point: `whole` (samples, seen) by a predictor, which
    has `done` so many samples of each recording before a value left all bounds.
    """

    values: Reals
    done: NDArray[np.int64]
    recorded: StackedRecordings
    huber_limits: Reals
    predictor: Predictor

    @cached_property
    def stacked(self) -> Reals:
        """The innovations behind the burn-in of each recording (n, seen), as in an Outcome."""
        return _stack_after_burn_in(self.values, self.recorded.starts, self.recorded.burn_in)

    @property
    def by_recording(self) -> tuple[Reals, ...]:
        """The innovations of each recording behind its burn-in, (samples, seen) each."""
        return tuple(_split_after_burn_in(self.values, self.recorded.starts, self.recorded.burn_in))

    @property
    def robust_square_sums(self) -> Reals:
        """The sums of the squares that count (recordings, seen)."""
        return self._sums[0]

    @property
    def counts(self) -> Reals:
        """How many innovations of each recording each channel has (recordings, seen)."""
        return self._sums[1]

    @cached_property
    def _sums(self) -> tuple[Reals, Reals]:
        return self.predictor.sum_squares(self.values, self.recorded, self.huber_limits)


def measured_noise_levels(
    series: Sequence[SampledRecording], process: Mapping[str, float]
) -> NoiseLevels:
    """Return the noise of the signals and inputs of some recordings: the median over them."""
    output_noise, inputs = [np.array([one.noise[k] for one in series]) for k in (0, 1)]
    floor = [float(np.nanmax(np.abs(one.measured))) * 1e-6 + 1e-12 for one in series]
    outputs = np.maximum(np.median(output_noise, axis=0), np.median(floor))
    return NoiseLevels(outputs, np.median(inputs, axis=0), process, np.full(len(outputs), np.inf))


def noise_levels_at(
    candidate: Candidate, point: ParameterVector, noise_levels: NoiseLevels
) -> NoiseLevels:
    """Return noises with the levels that a candidate has as coordinates, at a point."""
    if not candidate.noise_parameters:
        return noise_levels
    values = values_at(candidate, point, 0)
    levels = {
        name: values.get(PROCESS_NOISE_NAME.format(name)) for name in candidate.disturbance_states
    }
    drifts = {name: level for name, level in levels.items() if level is not None}
    signals = zip(candidate.predictor.outputs, noise_levels.outputs, strict=True)
    seen = np.array([values.get(OUTPUT_NOISE_NAME.format(name), noise) for name, noise in signals])
    largest = np.max(noise_levels.inputs, initial=0.0)
    inputs = (
        noise_levels.inputs * (values[INPUT_NOISE_NAME] / largest)
        if INPUT_NOISE_NAME in values
        else noise_levels.inputs
    )
    return dataclasses.replace(
        noise_levels, process={**noise_levels.process, **drifts}, outputs=seen, inputs=inputs
    )


def predict(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    values: Sequence[Mapping[str, float]],
    gains: KalmanGains,
    huber_limits: Reals,
) -> PredictionResult:
    """Return the innovations of recordings, each with values of its own (per recording)."""
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
    """Return the innovations of recordings at several points, each with `values` for each of them.

    All points are followed side by side; nothing is told of states.
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


def predict_with_gains(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    values: Sequence[Mapping[str, float]],
    gains: Sequence[KalmanGains],
    huber_limits: Reals,
) -> list[Innovations]:
    """Return the innovations of recordings, each with values of its own, with several gains.

    Those with as many first ones are followed side by side; nothing is told of states.
    """
    stacked = stack_recordings(series)
    recorded, predictor = stacked.recorded, candidate.predictor
    pages, results = (
        candidate.calibration_pages(values, stacked.first_measured),
        dict[int, Innovations](),
    )
    for count in {len(one.transient) for one in gains}:
        indices = [k for k, one in enumerate(gains) if len(one.transient) == count]
        runs = predictor.predict_points(
            np.repeat(pages[np.newaxis], len(indices), axis=0),
            recorded,
            np.array([gains[k].transient for k in indices]),
            np.array([gains[k].steady_state for k in indices]),
            candidate.compiled.substeps,
        )
        for k, run in zip(indices, zip(*runs, strict=True), strict=True):
            results[k] = Innovations(*run, recorded, huber_limits, predictor)
    return [results[k] for k in range(len(gains))]


@lru_cache
def _fold_blocks(edges: tuple[int, ...]) -> list[FoldBlock]:
    """Return recordings with such edges, each cut into `FOLDS` blocks."""
    found = []
    for r, (start, stop) in enumerate(pairwise(edges)):
        cuts = np.linspace(0, stop - start, FOLDS + 1).astype(int) + start
        parts = [slice(low, high) for low, high in pairwise(cuts.tolist())]
        found += [FoldBlock(r, (r + k) % FOLDS, part) for k, part in enumerate(parts)]
    return found


def _stack_after_burn_in(
    innovations: Reals, starts: NDArray[np.int64], burn_in: NDArray[np.int64]
) -> Reals:
    """Return the innovations of all recordings behind their burn-in, one after the other."""
    return np.concatenate(_split_after_burn_in(innovations, starts, burn_in))


def _split_after_burn_in(
    innovations: Reals, starts: NDArray[np.int64], burn_in: NDArray[np.int64]
) -> list[Reals]:
    edges = zip((starts[:-1] + burn_in).tolist(), starts[1:].tolist(), strict=True)
    return [innovations[low:high] for low, high in edges]
