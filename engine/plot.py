"""Plot: a trajectory as a picture, modes as a coloured band above the signals."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from engine.trajectory import Trajectory, Values

PALETTE = ("#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#777777")
"""Colours that colour-blind readers tell apart (Tol 2021, bright)."""


@dataclass(frozen=True)
class Line:
    """One curve: its signal in the trajectory, its label, a factor to the shown unit."""

    signal: str
    label: str
    factor: float = 1.0
    dashed: bool = False


@dataclass(frozen=True)
class Panel:
    """Curves over one axis."""

    title: str
    lines: Sequence[Line]


def picture(
    trajectory: Trajectory,
    panels: Sequence[Panel],
    mode_signals: Mapping[str, str],
    title: str,
    form: str = "png",
    span: tuple[float, float] | None = None,
) -> bytes:
    """Return a picture: one band per mode signal (label -> signal), then the panels."""
    heights = [0.28] * len(mode_signals) + [2.0] * len(panels)
    figure = Figure(figsize=(9.0, 1.2 + sum(heights)), layout="constrained")
    rows = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)
    axes = [row[0] for row in rows]
    window = span or _window(trajectory)
    for axis, (label, signal) in zip(axes, mode_signals.items(), strict=False):
        _mode_band(axis, trajectory, signal, label, window)
    for axis, panel in zip(axes[len(mode_signals) :], panels, strict=True):
        _panel(axis, trajectory, panel, window)
    axes[0].set_title(title, loc="left", fontsize=11)
    axes[-1].set_xlabel("time [s]")
    axes[-1].set_xlim(*window)
    buffer = io.BytesIO()
    metadata = {"Date": None} if form == "svg" else {}
    with matplotlib.rc_context({"svg.hashsalt": "modewright"}):
        figure.savefig(buffer, format=form, dpi=130, metadata=metadata)
    return buffer.getvalue()


def all_panels(trajectory: Trajectory) -> list[Panel]:
    """Return one panel per unit with every real signal of the trajectory."""
    by_unit: dict[str, list[Line]] = {}
    for name, values in trajectory.signals.items():
        if values.dtype == np.float64:
            by_unit.setdefault(trajectory.units[name], []).append(Line(name, name))
    return [Panel(f"[{unit}]", lines) for unit, lines in by_unit.items()]


def _window(trajectory: Trajectory) -> tuple[float, float]:
    times = trajectory.times
    return (float(times[0]), float(times[-1])) if len(times) > 1 else (0.0, 1.0)


def _mode_band(
    axis: Axes, trajectory: Trajectory, signal: str, label: str, window: tuple[float, float]
) -> None:
    names = trajectory.modes[signal]
    colours = {number: PALETTE[k % len(PALETTE)] for k, number in enumerate(sorted(names))}
    for start, end, number in _stretches(trajectory.times, trajectory.signals[signal]):
        axis.axvspan(start, end, color=colours[number], alpha=0.75, lw=0)
        left, right = max(start, window[0]), min(end, window[1])
        if right - left > 0.07 * (window[1] - window[0]):
            text = names[number]
            middle = 0.5 * (left + right)
            axis.text(middle, 0.5, text, ha="center", va="center", fontsize=8, color="white")
    axis.set_yticks([0.5], [label], fontsize=8)
    axis.set_ylim(0.0, 1.0)
    axis.tick_params(length=0, labelbottom=False)
    for side in axis.spines.values():
        side.set_visible(False)


def _stretches(times: Values, modes: Values) -> list[tuple[float, float, int]]:
    """Return the stretches of equal mode as start, end, number."""
    if len(times) == 0:
        return []
    changes = np.flatnonzero(np.diff(modes)) + 1
    starts = np.concatenate(([0], changes))
    ends = np.concatenate((changes, [len(times) - 1]))
    return [
        (float(times[a]), float(times[b]), int(modes[a])) for a, b in zip(starts, ends, strict=True)
    ]


def _panel(axis: Axes, trajectory: Trajectory, panel: Panel, window: tuple[float, float]) -> None:
    shown = (trajectory.times >= window[0]) & (trajectory.times <= window[1])
    for k, line in enumerate(panel.lines):
        values = trajectory.signals[line.signal] * line.factor
        style = "--" if line.dashed else "-"
        colour = PALETTE[k % len(PALETTE)]
        axis.plot(
            trajectory.times[shown], values[shown], style, color=colour, lw=1.2, label=line.label
        )
    axis.set_ylabel(panel.title)
    axis.grid(alpha=0.3)
    axis.legend(loc="upper right", fontsize=8, framealpha=0.9)
