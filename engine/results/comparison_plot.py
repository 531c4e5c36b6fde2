"""Difference picture: the signals that differ most, both runs and their difference beneath."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from engine.results.mode_band import ModeBand
from engine.results.plot import Panel, Picture, PlotLine, axis_title, draw_picture
from engine.results.run_comparison import RunDifference, SignalDifference, resample_signal
from engine.results.trajectory import Trajectory

MAX_SIGNALS = 4
"""Most signals drawn: the picture stays on one page."""


def draw_difference(
    a: Trajectory, b: Trajectory, difference: RunDifference, labels: Sequence[str] = ("A", "B")
) -> Picture:
    """Return the picture of two runs; windows in which modes disagree are shaded."""
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
    apart_in = {window.signal for window in difference.windows}
    bands = [
        ModeBand(f"{name.removesuffix('.mode')}, {'AB'[run]}", name, run)
        for name in [name for name in named if name in apart_in] or named
        for run, each in enumerate((a, b))
        if name in each.modes and name in each.signals
    ]
    shaded = [(window.start, window.end) for window in difference.windows]
    title = f"A: {labels[0]}; B: {labels[1]}" + ("; shaded: modes disagree" if shaded else "")
    return draw_picture([a, b, residual_run], panels, bands, title, difference.span, shaded)


def _most_different(a: Trajectory, difference: RunDifference) -> list[SignalDifference]:
    def share(signal: SignalDifference) -> float:
        peak = float(np.max(np.abs(np.nan_to_num(a.signals[signal.name])), initial=0.0))
        return signal.rms / peak if peak else signal.rms

    return sorted(difference.signals, key=share, reverse=True)[:MAX_SIGNALS]
