"""Operating points: where each mode was active in a prediction,
and the linearised candidate there.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np
from numpy.typing import NDArray

from codegen.predictor.predictor_arrays import StackedPrediction
from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.innovations import PredictionResult
from diagnosis.estimation.linearisation import LinearModel, linearise
from diagnosis.model.candidate import Candidate

Integers = NDArray[np.int64]
ModeModels = dict[int, tuple[LinearModel, int]]
"""For each mode the linearised candidate and the median dwell time [samples]."""
MIN_DWELL_SAMPLES = 5
"""Modes with only shorter stays [samples] have the gain of the mode with the longest stay."""
STATE_STEP_FRACTION = 1e-5
"""Step of a state for a finite difference, as a fraction of its range."""
CACHE_SIZE = 4
"""Number of cached sets of models; fits with other noise levels use the same ones."""

_cache: OrderedDict[tuple[object, ...], tuple[ModeModels, object]] = OrderedDict()


def linearise_modes(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    calibration_page: Reals,
    prediction: PredictionResult | None,
) -> ModeModels:
    """Return the linearised candidate and the median dwell time of each mode, longest stay first.

    The points are those of `operating_points`. Modes in which the linearisation is invalid are left
    out. The last `CACHE_SIZE` (4) results are cached by the page and the identity of the predictor,
    the compiled model, the prediction and the recordings, which the entry holds.
    """
    held = candidate.predictor, candidate.compiled, prediction, *series
    key = calibration_page.tobytes(), *map(id, held)
    found = _cache.pop(key, None) or (
        _compute_linearised_modes(candidate, series, calibration_page, prediction),
        held,
    )
    _cache[key] = found
    if len(_cache) > CACHE_SIZE:
        _cache.popitem(last=False)
    return found[0]


def _compute_linearised_modes(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    calibration_page: Reals,
    prediction: PredictionResult | None,
) -> ModeModels:
    """Return the linearised candidate in each mode without the cache."""
    found = {}
    for mode, point in operating_points(candidate, series, prediction).items():
        linear = linearise_near(candidate, calibration_page, mode, point)
        if linear is not None:
            found[mode] = linear, point.dwell_samples
    return found


@dataclass(frozen=True)
class OperatingPoint:
    """A point where a mode is active: `states`, `inputs` and the median dwell time [samples].

    `input_sizes` (inputs,) are the largest magnitudes of the inputs in all recordings.
    """

    states: Reals
    inputs: Reals
    dwell_samples: int
    input_sizes: Reals


def linearise_near(
    candidate: Candidate, calibration_page: Reals, mode: int, point: OperatingPoint
) -> LinearModel | None:
    """Return the candidate linearised over one sample in a mode near a point; None if invalid.

    The steps of the states are `STATE_STEP_FRACTION` of their ranges; see `linearise`.
    """
    return linearise(
        candidate.predictor,
        calibration_page,
        mode,
        candidate.compiled.substeps,
        point.states,
        point.inputs,
        STATE_STEP_FRACTION * candidate.state_ranges,
        point.input_sizes,
    )


def operating_points(
    candidate: Candidate, series: Sequence[SampledRecording], prediction: PredictionResult | None
) -> dict[int, OperatingPoint]:
    """Return an operating point of each mode in a prediction, the mode with the longest stay first.

    It lies in the longest stay of the mode, without its first and last fifth, at the sample where
    the measured outputs are largest, relative to their largest magnitudes, because friction is
    steep near standstill. Of several longest stays it is the one with the largest outputs there.
    Modes whose stays are all shorter than `MIN_DWELL_SAMPLES` (5) are left out. Without a
    prediction the result is the start of the recording with the largest outputs there, at declared
    parameter values.
    """
    input_sizes = np.max([one.largest_inputs for one in series], axis=0)
    output_sizes = np.max([one.largest_measured for one in series], axis=0)
    if prediction is None:
        return _initial_operating_point(candidate, series, input_sizes, output_sizes)
    points = {}
    runs = prediction.runs
    lows, highs, modes, recordings = _dwell_intervals(runs)
    for mode in sorted(set(modes.tolist())):
        intervals = np.flatnonzero(modes == mode)
        lengths = highs[intervals] - lows[intervals]
        if np.max(lengths) < MIN_DWELL_SAMPLES:
            continue
        largest = [
            (*_largest_output(series[recordings[k]].measured, lows[k], highs[k], output_sizes), k)
            for k in intervals[lengths == np.max(lengths)]
        ]
        _, sample, best = max(largest, key=lambda one: one[0])
        recording = recordings[best]
        states = runs.stacked.states[runs.starts[recording] + sample]
        inputs = series[recording].inputs[sample]
        dwell = max(1, round(median(lengths.tolist())))
        points[mode] = (
            int(np.max(lengths)),
            OperatingPoint(states.copy(), inputs.copy(), dwell, input_sizes),
        )
    ordered = sorted(points.items(), key=lambda item: -item[1][0])
    return {mode: seen for mode, (_, seen) in ordered}


def _dwell_intervals(runs: StackedPrediction) -> tuple[Integers, Integers, Integers, Integers]:
    """Return the first sample of each stay in a mode, the end sample, the mode and the recording.

    Samples count from the start of the recording; samples after a run diverged are left out.
    """
    modes, starts = runs.stacked.modes, runs.starts
    begins = np.ones(len(modes), dtype=np.bool_)
    begins[1:] = modes[1:] != modes[:-1]
    ends = starts[:-1] + runs.completed
    begins[starts[:-1]] = True
    begins[ends[ends < starts[1:]]] = True
    edges = np.append(np.flatnonzero(begins), len(modes))
    recordings = np.searchsorted(starts, edges[:-1], side="right") - 1
    is_within = edges[:-1] < ends[recordings]
    lows, highs, recordings = edges[:-1][is_within], edges[1:][is_within], recordings[is_within]
    return lows - starts[recordings], highs - starts[recordings], modes[lows], recordings


def _initial_operating_point(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    input_sizes: Reals,
    output_sizes: Reals,
) -> dict[int, OperatingPoint]:
    """Return the operating point at the start of the recording with the largest outputs there."""
    one = max(series, key=lambda one: _largest_output(one.measured, 0, 1, output_sizes)[0])
    predictor = candidate.predictor
    page = candidate.calibration_page({}, one)
    none = np.zeros((len(predictor.modes), len(predictor.states), len(predictor.outputs)))
    short, measured = one.inputs[:2].copy(), one.measured[:2].copy()
    run = predictor.predict(
        page, short, measured, none[:0], none, candidate.compiled.substeps, one.linear_inputs
    )
    return {int(run.modes[0]): OperatingPoint(run.states[0].copy(), short[0], 1, input_sizes)}


def _largest_output(measured: Reals, low: int, high: int, sizes: Reals) -> tuple[float, int]:
    """Return the largest sum of the outputs' magnitudes in a stay, and its sample.

    The magnitudes are relative to `sizes` (outputs,). The first and last fifth of the stay are left
    out. In a very short stay the sample is the middle, with a sum of 0.
    """
    margin = (high - low) // 5
    inner = np.abs(measured[low + margin : high - margin]) / np.where(sizes > 0.0, sizes, 1.0)
    level = np.sum(np.where(np.isfinite(inner), inner, 0.0), axis=1)
    if not len(level):
        return 0.0, int((low + high) // 2)
    k = int(np.argmax(level))
    return float(level[k]), int(low + margin + k)
