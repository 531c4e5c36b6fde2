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
    """A window: times [s] (n,), `inputs` (n, inputs) and outputs (n, outputs) in SI.

    Base (`before`) and model (`after`) run freely from `free_from` [s].
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
    """Outputs [SI] of recordings by two models, observed and free, (samples, outputs) each."""

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
    """Return name and errors [SI] of free parts, before and after (outputs,), or NaN."""
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

    Windows are adjacent and `WINDOW_TIME` long; errors after `OBSERVED_TIME` count. `label` names
    the set of recordings in the title.
    """
    series, before, after = runs.series, runs.before, runs.after
    spread = np.nanstd(np.concatenate([one.measured for one in series]), axis=0)
    scale = np.maximum(spread, 1e-12)
    most, k, window = -1.0, 0, slice(0)
    for r, one in enumerate(series):
        observed, whole = one.sample_count(OBSERVED_TIME), one.sample_count(WINDOW_TIME)
        for start in range(0, max(1, one.count - observed - 1), whole):
            end = min(one.count, start + whole)
            alone = slice(start + observed, end)
            missed = (one.measured[alone] - before[r][alone]) / scale
            squares = float(np.nansum(missed**2))
            if squares > most:
                most, k, window = squares, r, slice(start, end)
    one = series[k]
    period = float(one.period)
    times = float(one.start) + np.arange(window.start, window.stop) * period
    return WorstWindow(
        one.name,
        f"worst window of the {label} recordings: {one.name}, {times[0]:.4g} to {times[-1]:.4g} s",
        float(one.start) + (window.start + one.sample_count(OBSERVED_TIME)) * period,
        times,
        one.inputs[window],
        one.measured[window],
        before[k][window],
        after[k][window],
        runs.signals,
        tuple(units),
    )
