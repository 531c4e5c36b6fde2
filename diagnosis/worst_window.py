"""Worst window: where free simulation of the base misses most, with the model beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from diagnosis.estimation import Estimate
from diagnosis.series import Series
from diagnosis.simulation import FREE, OBSERVED, free, is_free
from engine.band import PALETTE
from engine.plot import Picture
from language.text import visible

Reals = NDArray[np.float64]
BLUE, RED, *_ = PALETTE


@dataclass(frozen=True)
class WorstWindow:
    """A window of a recording: times [s] (n,), `measured`, `before`, `after` (n, seen) in SI.

    The model is alone from `alone` [s] on. `units` are those of the signals.
    """

    recording: str
    alone: float
    times: Reals
    measured: Reals
    before: Reals
    after: Reals
    signals: tuple[str, ...]
    units: tuple[str, ...]


@dataclass(frozen=True)
class FreeRuns:
    """Free simulations of recordings: `before` and `after`, (samples, seen) of each, in SI."""

    series: Sequence[Series]
    before: Sequence[Reals]
    after: Sequence[Reals]
    signals: tuple[str, ...]


def free_runs(base: Estimate, model: Estimate, series: Sequence[Series]) -> FreeRuns:
    """Return how both models go where they are alone."""
    names = tuple(base.candidate.predictor.seen)
    return FreeRuns(series, free(base, series), free(model, series), names)


def by_recording(runs: FreeRuns) -> list[tuple[str, Reals, Reals]]:
    """Return name and root mean squares of what is missed, before and after (seen,), in SI."""
    found = []
    for one, before, after in zip(runs.series, runs.before, runs.after, strict=True):
        alone = is_free(one)
        missed = [np.nanmean((one.measured - run)[alone] ** 2, axis=0) for run in (before, after)]
        found.append((one.name, np.sqrt(missed[0]), np.sqrt(missed[1])))
    return found


def worst_window(runs: FreeRuns, units: Sequence[str]) -> WorstWindow:
    """Return the window in which the base, alone, misses most: squares over those of a signal."""
    series, before, after = runs.series, runs.before, runs.after
    spread = np.nanstd(np.concatenate([one.measured for one in series]), axis=0)
    scale = np.maximum(spread, 1e-12)
    most, place = -1.0, (0, 0)
    for k, one in enumerate(series):
        for start in _starts(one):
            window = _window(one, start)
            alone = slice(start + _samples(one, OBSERVED), window.stop)
            missed = (one.measured[alone] - before[k][alone]) / scale
            squares = float(np.nansum(missed**2))
            if squares > most:
                most, place = squares, (k, start)
    k, start = place
    one, window = series[k], _window(series[k], start)
    period = float(one.period)
    return WorstWindow(
        one.name,
        float(one.start) + (start + _samples(one, OBSERVED)) * period,
        float(one.start) + np.arange(window.start, window.stop) * period,
        one.measured[window],
        before[k][window],
        after[k][window],
        runs.signals,
        tuple(units),
    )


def _samples(series: Series, seconds: float) -> int:
    return round(seconds / float(series.period))


def _starts(series: Series) -> range:
    """Return the first samples of the windows that have a part in which the model is alone."""
    last = max(1, series.count - _samples(series, OBSERVED) - 1)
    return range(0, last, max(1, _samples(series, OBSERVED + FREE)))


def _window(series: Series, start: int) -> slice:
    return slice(start, min(series.count, start + _samples(series, OBSERVED + FREE)))


def window_picture(window: WorstWindow, title: str, is_same: bool) -> Picture:
    """Return the picture of a window: signals above, what they miss beneath.

    `is_same`: nothing was laid over the base, so that one simulation is all there is.
    """
    count = len(window.signals)
    figure = Figure(figsize=(8.5, 0.8 + 2.2 * count), layout="constrained")
    rows = figure.subplots(
        2 * count, 1, sharex=True, squeeze=False, height_ratios=[1.7, 1.0] * count
    )
    for k, name in enumerate(window.signals):
        above, beneath = rows[2 * k][0], rows[2 * k + 1][0]
        known = np.isfinite(window.measured[:, k])
        times, measured = window.times[known], window.measured[known, k]
        above.plot(times, measured, ".", color="black", ms=3, label="recorded")
        runs = [(window.before, RED, "without the effect", "--")]
        runs += [(window.after, BLUE, "with the effect", "-")]
        if is_same:
            runs = [(window.before, RED, "simulated, recalibrated", "-")]
        for values, colour, label, style in runs:
            above.plot(window.times, values[:, k], style, color=colour, lw=1.3, label=label)
            missed = measured - values[known, k]
            beneath.plot(times, missed, style, color=colour, lw=1.1)
        beneath.axhline(0.0, color="black", lw=0.6)
        unit = window.units[k]
        above.set_ylabel(visible(f"{name} [{unit}]"), fontsize=9, parse_math=False)
        beneath.set_ylabel("missed", fontsize=9, parse_math=False)
        for axis in (above, beneath):
            axis.grid(alpha=0.3)
            axis.axvspan(window.times[0], window.alone, color="#999999", alpha=0.15, lw=0)
    top = rows[0][0]
    top.legend(loc="best", fontsize=8)
    top.set_title(visible(title), loc="left", fontsize=11, parse_math=False)
    rows[-1][0].set_xlabel("time [s]; grey: an observer follows, then the model is alone")
    return Picture(figure)
