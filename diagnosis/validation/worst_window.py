"""Worst window: where the free simulation of the base has its largest error, beside the model's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate
from diagnosis.validation.free_simulation import OBSERVED_TIME, WINDOW_TIME, is_free, simulate_free


@dataclass(frozen=True)
class WorstWindow:
    """A window of a recording: times [s] (n,), `inputs` (n, inputs) and outputs (n, outputs) in SI.

    `before` and `after` are the outputs of the base and the model, which run freely from
    `free_from` [s]. `units` are those of the signals; `title` names the recordings of which it is
    the worst.
    """

    recording: str
    title: str
    free_from: float
    times: Reals
    inputs: Reals
    measured: Reals
    before: Reals
    after: Reals
    signals: tuple[str, ...]
    units: tuple[str, ...]


@dataclass(frozen=True)
class FreeRuns:
    """Outputs [SI] of recordings by two models, observed and free in turn.

    Each has the shape (samples, outputs).
    """

    series: Sequence[SampledRecording]
    before: Sequence[Reals]
    after: Sequence[Reals]
    signals: tuple[str, ...]


def simulate_free_runs(
    base: Estimate, model: Estimate, series: Sequence[SampledRecording]
) -> FreeRuns:
    """Return the outputs of base and model, observed and free in turn, as by `simulate_free`."""
    names = tuple(base.candidate.predictor.outputs)
    return FreeRuns(series, simulate_free(base, series), simulate_free(model, series), names)


def rms_by_recording(runs: FreeRuns) -> list[tuple[str, Reals, Reals]]:
    """Return name and root mean square errors [SI] of each recording, before and after (outputs,).

    Only known values in the free parts (`is_free`) count; an output without any has NaN.
    """
    found = []
    for one, before, after in zip(runs.series, runs.before, runs.after, strict=True):
        alone = is_free(one)
        errors = [(one.measured - run)[alone] for run in (before, after)]
        found.append((one.name, _root_mean_square(errors[0]), _root_mean_square(errors[1])))
    return found


def _root_mean_square(errors: Reals) -> Reals:
    """Return the root mean square of known errors (n, outputs) of each output, NaN without any."""
    counts = np.sum(np.isfinite(errors), axis=0)
    squares = np.sum(np.where(np.isfinite(errors), errors, 0.0) ** 2, axis=0)
    return np.asarray(np.where(counts > 0, np.sqrt(squares / np.maximum(counts, 1)), np.nan))


def find_worst_window(runs: FreeRuns, units: Sequence[str], label: str) -> WorstWindow:
    """Return the window with the largest sum of normalised squared errors of the base.

    Windows are `WINDOW_TIME` (12.5 reference times) long and adjacent, the last one of a recording
    may be shorter; only errors after `OBSERVED_TIME` count, over the standard deviation of the
    signal in all recordings. The first of equal windows is taken. `label` names the set of
    recordings in the title, `units` are those of the signals.
    """
    series, before, after = runs.series, runs.before, runs.after
    spread = np.nanstd(np.concatenate([one.measured for one in series]), axis=0)
    scale = np.maximum(spread, 1e-12)
    most, place = -1.0, (0, 0)
    for k, one in enumerate(series):
        for start in _window_starts(one):
            window = _window_slice(one, start)
            alone = slice(start + one.sample_count(OBSERVED_TIME), window.stop)
            missed = (one.measured[alone] - before[k][alone]) / scale
            squares = float(np.nansum(missed**2))
            if squares > most:
                most, place = squares, (k, start)
    k, start = place
    one, window = series[k], _window_slice(series[k], start)
    period = float(one.period)
    times = float(one.start) + np.arange(window.start, window.stop) * period
    return WorstWindow(
        one.name,
        f"worst window of the {label} recordings: {one.name}, {times[0]:.4g} to {times[-1]:.4g} s",
        float(one.start) + (start + one.sample_count(OBSERVED_TIME)) * period,
        times,
        one.inputs[window],
        one.measured[window],
        before[k][window],
        after[k][window],
        runs.signals,
        tuple(units),
    )


def _window_starts(series: SampledRecording) -> range:
    """Return the first samples of the windows that contain free simulation."""
    last = max(1, series.count - series.sample_count(OBSERVED_TIME) - 1)
    return range(0, last, series.sample_count(WINDOW_TIME))


def _window_slice(series: SampledRecording, start: int) -> slice:
    """Return the samples of the window at a start."""
    return slice(start, min(series.count, start + series.sample_count(WINDOW_TIME)))
