"""Difference picture: the signals that differ most, both runs and their difference beneath."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from engine.band import Band
from engine.difference import RunDifference, SignalDifference, at_times
from engine.plot import Line, Panel, Picture, axis_title, picture
from engine.trajectory import Trajectory

MOST_SIGNALS = 4
"""Most signals drawn: the picture stays on one page."""


def difference_picture(
    a: Trajectory, b: Trajectory, found: RunDifference, labels: Sequence[str] = ("A", "B")
) -> Picture:
    """Return the picture of two runs; windows in which modes disagree are shaded."""
    shown = _most_different(a, found)
    times = a.times[(a.times >= found.span[0]) & (a.times <= found.span[1])]
    with np.errstate(invalid="ignore"):
        apart = {s.name: at_times(a, s.name, times) - at_times(b, s.name, times) for s in shown}
    rest = Trajectory("difference", times, apart, {s.name: s.unit for s in shown}, {}, ())
    panels = []
    for k, signal in enumerate(shown):
        both = [
            Line(signal.name, f"{signal.name}, A", colour=k),
            Line(signal.name, f"{signal.name}, B", dashed=True, run=1, colour=k),
        ]
        panels.append(Panel(axis_title(signal.unit), both))
        line = Line(signal.name, f"A - B, RMS {signal.rms:.3g}", run=2, colour=6)
        panels.append(Panel(f"[{signal.unit}]", [line], 0.9))
    named = [name for name in dict.fromkeys((*a.modes, *b.modes))]
    apart_in = {window.signal for window in found.windows}
    bands = [
        Band(f"{name.removesuffix('.mode')}, {'AB'[run]}", name, run)
        for name in [name for name in named if name in apart_in] or named
        for run, each in enumerate((a, b))
        if name in each.modes and name in each.signals
    ]
    shaded = [(window.start, window.end) for window in found.windows]
    title = f"A: {labels[0]}; B: {labels[1]}" + ("; shaded: modes disagree" if shaded else "")
    return picture([a, b, rest], panels, bands, title, found.span, shaded)


def _most_different(a: Trajectory, found: RunDifference) -> list[SignalDifference]:
    def share(signal: SignalDifference) -> float:
        peak = float(np.max(np.abs(np.nan_to_num(a.signals[signal.name])), initial=0.0))
        return signal.rms / peak if peak else signal.rms

    return sorted(found.signals, key=share, reverse=True)[:MOST_SIGNALS]
