"""Modes: where each mode of a candidate was seen, and what the candidate is near there."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np
from numpy.typing import NDArray

from codegen.predictor.predictions import StackedPrediction
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.innovations import PredictionResult
from diagnosis.estimation.linearisation import LinearModel, linearise
from diagnosis.model.candidate import Candidate

Reals = NDArray[np.float64]
Integers = NDArray[np.int64]
ModeModels = dict[int, tuple[LinearModel, int]]
"""By mode, a candidate over one sample near where it was seen, and the usual stay [samples]."""
MIN_DWELL_SAMPLES = 5
"""Samples: a mode that is left sooner has the gain of the mode that lasts longest."""
STATE_STEP_FRACTION = 1e-5
"""Change of a state for a difference, as a part of its range."""
CACHE_SIZE = 4
"""Models of candidates that are kept, the latest ones: levels of noise move, and they stay."""

_cache: OrderedDict[tuple[object, ...], tuple[ModeModels, object]] = OrderedDict()


def linearise_modes(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    calibration_page: Reals,
    prediction: PredictionResult | None,
) -> ModeModels:
    """Return the models of a candidate with a page near where `prediction` saw its modes, the longest
    stay first; as they were kept or made now. None of a mode in which it is unstable.

    What they are made of is known by its identity: what is kept holds it.
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
    found = {}
    for mode, point in operating_points(candidate, series, prediction).items():
        linear = linearise_near(candidate, calibration_page, mode, point.states, point.inputs)
        if linear is not None:
            found[mode] = linear, point.dwell_samples
    return found


def linearise_near(
    candidate: Candidate, calibration_page: Reals, mode: int, states: Reals, inputs: Reals
) -> LinearModel | None:
    """Return a candidate over one sample, linearised in a mode near a point; None if unstable."""
    substeps, sizes = candidate.compiled.substeps, STATE_STEP_FRACTION * candidate.state_ranges
    return linearise(candidate.predictor, calibration_page, mode, substeps, states, inputs, sizes)


@dataclass(frozen=True)
class OperatingPoint:
    """Where a mode was seen: `states` and `inputs` there, and the usual `stay` in it [samples]."""

    states: Reals
    inputs: Reals
    dwell_samples: int


def operating_points(
    candidate: Candidate, series: Sequence[SampledRecording], prediction: PredictionResult | None
) -> dict[int, OperatingPoint]:
    """Return where each mode was seen, in its longest stay; the mode with the longest first.

    Where the first compared signal is largest: friction is steep near rest alone.
    """
    if prediction is None:
        return _initial_operating_point(candidate, series[0])
    points = {}
    runs = prediction.runs
    lows, highs, modes, recordings = _dwell_intervals(runs)
    for mode in sorted(set(modes.tolist())):
        intervals = np.flatnonzero(modes == mode)
        lengths = highs[intervals] - lows[intervals]
        best = intervals[np.argmax(lengths)]
        if np.max(lengths) >= MIN_DWELL_SAMPLES:
            one, states = (
                series[recordings[best]],
                runs.stacked.states[runs.starts[recordings[best]] :],
            )
            k = _largest_output_sample(one.measured, int(lows[best]), int(highs[best]))
            dwell = max(1, round(median(lengths.tolist())))
            points[mode] = (
                int(np.max(lengths)),
                OperatingPoint(states[k].copy(), one.inputs[k].copy(), dwell),
            )
    ordered = sorted(points.items(), key=lambda item: -item[1][0])
    return {mode: seen for mode, (_, seen) in ordered}


def _dwell_intervals(runs: StackedPrediction) -> tuple[Integers, Integers, Integers, Integers]:
    """Return the first sample of each stay in a mode, the one behind it, its mode and recording."""
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
    candidate: Candidate, series: SampledRecording
) -> dict[int, OperatingPoint]:
    """Return where a recording starts."""
    predictor = candidate.predictor
    page = candidate.calibration_page({}, series)
    none = np.zeros((len(predictor.modes), len(predictor.states), len(predictor.outputs)))
    short, measured = series.inputs[:2].copy(), series.measured[:2].copy()
    run = predictor.predict(
        page, short, measured, none[:0], none, candidate.compiled.substeps, False
    )
    return {int(run.modes[0]): OperatingPoint(run.states[0].copy(), short[0], 1)}


def _largest_output_sample(measured: Reals, low: int, high: int) -> int:
    """Return the sample of a stay, not near its ends, at which the first signal is largest."""
    margin = (high - low) // 5
    inner = np.abs(measured[low + margin : high - margin, 0])
    known = np.where(np.isfinite(inner), inner, -1.0)
    return low + margin + int(np.argmax(known)) if len(known) else (low + high) // 2
