"""Comparison plot: the signals that differ most, with both runs and their difference."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from engine.results.mode_band import ModeBand
from engine.results.plot import Panel, Picture, PlotLine, axis_title, draw_picture
from engine.results.resampling import resample_signal
from engine.results.run_comparison import (
    RunDifference,
    SignalDifference,
    rename_instance,
)
from engine.results.trajectory import Trajectory

MAX_SIGNALS = 4
"""Largest number of drawn signals, so that the picture fits on a page."""


def draw_difference(
    a: Trajectory, b: Trajectory, difference: RunDifference, labels: Sequence[str] = ("A", "B")
) -> Picture:
    """Return a picture of two runs over their common span, windows of different modes shaded.

    Drawn are the `MAX_SIGNALS` signals with the largest RMS difference relative to their peak in A.
    Each has a panel with both runs (B dashed) and one with the difference A - B at the samples of
    A. Bands are those of mode signals that differ, or of all if none does. `labels` name the runs
    in the title.
    """
    b = rename_instance(b, a)
    shown = _most_different(a, difference)
    times = a.times[(a.times >= difference.span[0]) & (a.times <= difference.span[1])]
    with np.errstate(invalid="ignore"):
        residuals = {
            s.name: resample_signal(a, s.name, times) - resample_signal(b, s.name, times)
            for s in shown
        }
    residual_run = Trajectory(
        "difference", times, residuals, {s.name: s.unit for s in shown}, {}, ()
    )
    panels = []
    for k, signal in enumerate(shown):
        both = [
            PlotLine(signal.name, f"{signal.name}, A", colour=k),
            PlotLine(signal.name, f"{signal.name}, B", dashed=True, run=1, colour=k),
        ]
        panels.append(Panel(axis_title(signal.unit), both))
        line = PlotLine(signal.name, f"A - B, RMS {signal.rms:.3g}", run=2, colour=6)
        panels.append(Panel(f"[{signal.unit}]", [line], 0.9))
    named = [name for name in dict.fromkeys((*a.modes, *b.modes))]
    disagreeing = {window.signal for window in difference.windows}
    bands = [
        ModeBand(f"{name.removesuffix('.mode')}, {'AB'[run]}", name, run)
        for name in [name for name in named if name in disagreeing] or named
        for run, each in enumerate((a, b))
        if name in each.modes and name in each.signals
    ]
    shaded = [(window.start, window.end) for window in difference.windows]
    title = f"A: {labels[0]}; B: {labels[1]}" + ("; shaded: modes disagree" if shaded else "")
    return draw_picture([a, b, residual_run], panels, bands, title, difference.span, shaded)


def _most_different(a: Trajectory, difference: RunDifference) -> list[SignalDifference]:
    """Return the signals with the largest RMS difference relative to their peak in `a`."""

    def share(signal: SignalDifference) -> float:
        peak = float(np.max(np.abs(np.nan_to_num(a.signals[signal.name])), initial=0.0))
        return signal.rms / peak if peak else signal.rms

    return sorted(difference.signals, key=share, reverse=True)[:MAX_SIGNALS]
