"""Plot: runs as a picture: modes as coloured bands above the signals, mode changes marked."""

from __future__ import annotations

import fnmatch
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from engine.results.mode_band import PALETTE, ModeBand, draw_band, label_segments
from engine.results.samples import SampledRun
from language.reading.mode_reader import IMPLICIT_MODE
from language.text.diagnostic import suggest_name
from language.text.sanitise import escape_invisible

QUANTITIES = {
    "1": "number", "A": "current", "K": "temperature", "N": "force", "N*m": "torque",
    "Pa": "pressure", "V": "voltage", "W": "power", "m": "length", "m/s": "speed",
    "m/s^2": "acceleration", "rad": "angle", "rad/s": "angular speed",
    "rad/s^2": "angular acceleration", "s": "time",
}  # fmt: skip
"""What is written beside a unit on an axis."""
MAX_PEAK_RATIO = 6.0
"""Ratio of peaks from which two neighbours in size do not share an axis: the smaller looks flat."""
MAX_MARKERS = 200
"""Most mode changes marked in a panel; beyond, lines would be a grey area."""


@dataclass(frozen=True)
class PlotLine:
    """One curve: its signal, its label, a factor to the shown unit, the run that it is of."""

    signal: str
    label: str
    factor: float = 1.0
    dashed: bool = False
    run: int = 0
    colour: int | None = None


@dataclass(frozen=True)
class Panel:
    """Curves over one axis; `height` in inches."""

    title: str
    lines: Sequence[PlotLine]
    height: float = 2.0


@dataclass(frozen=True)
class Picture:
    """A drawn figure; a notebook shows it, `data` gives the bytes of a file."""

    figure: Figure

    def data(self, form: str = "png") -> bytes:
        """Return the picture as `png`, `svg` or `pdf`, without a date."""
        buffer = io.BytesIO()
        metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(form, {})
        with matplotlib.rc_context({"svg.hashsalt": "modewright"}):
            self.figure.savefig(buffer, format=form, dpi=130, metadata=metadata)
        return buffer.getvalue()

    def save(self, path: str | Path) -> None:
        """Write the picture; the ending of the name says in which format."""
        Path(path).write_bytes(self.data(Path(path).suffix.lower()[1:]))

    def _repr_png_(self) -> bytes:
        return self.data()


def draw_picture(
    runs: Sequence[SampledRun],
    panels: Sequence[Panel],
    bands: Sequence[ModeBand],
    title: str,
    span: tuple[float, float] | None = None,
    shaded: Sequence[tuple[float, float]] = (),
) -> Picture:
    """Return a picture: the bands, then the panels, over one axis of time [s].

    The windows `shaded` [s] are drawn red behind the panels.
    """
    heights = [0.28] * len(bands) + [panel.height for panel in panels] or [1.0]
    figure = Figure(figsize=(9.0, 1.2 + sum(heights)), layout="constrained")
    rows = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)
    axes = [row[0] for row in rows]
    window = _time_window(runs, span)
    strips = [
        draw_band(axis, runs[band.run], band, window)
        for axis, band in zip(axes, bands, strict=False)
    ]
    for axis, panel in zip(axes[len(bands) :], panels, strict=True):
        _draw_panel(axis, runs, panel, window)
        for start, end in shaded:
            axis.axvspan(start, end, color=PALETTE[1], alpha=0.2, lw=0, zorder=-1)
        axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8, frameon=False)
    axes[0].set_title(escape_invisible(title), loc="left", fontsize=11, parse_math=False)
    axes[-1].set_xlabel("time [s]")
    axes[-1].tick_params(labelbottom=True)
    axes[-1].set_xlim(*window)
    if any(strips):
        figure.draw_without_rendering()  # what fits is known when the axes have their places
    for axis, stretches in zip(axes, strips, strict=False):
        label_segments(axis, stretches)
    return Picture(figure)


def draw_overview(
    runs: Sequence[SampledRun],
    patterns: Sequence[str] = (),
    span: tuple[float, float] | None = None,
    title: str = "",
    labels: Sequence[str] = ("A", "B"),
) -> Picture:
    """Return a picture of all signals (or those that match a pattern) of one run or two.

    The second run is dashed, in the colours of the first. Raises ValueError for an unknown signal.
    """
    _require_matches(runs, patterns)
    two = len(runs) > 1
    bands = [
        ModeBand(name.removesuffix(".mode") + (f", {labels[run]}" if two else ""), name, run)
        for name in dict.fromkeys(name for each in runs for name in each.modes)
        for run, each in enumerate(runs)
        if name in each.signals and _matches(name, patterns) and _has_modes(each, name)
    ]
    title = title or " and ".join(dict.fromkeys(run.name for run in runs))
    return draw_picture(runs, panels_by_unit(runs, patterns, labels), bands, title, span)


def panels_by_unit(
    runs: Sequence[SampledRun], patterns: Sequence[str] = (), labels: Sequence[str] = ("A", "B")
) -> list[Panel]:
    """Return panels of signals by unit, those far apart in size in panels of their own."""
    by_unit: dict[str, list[str]] = {}
    for run in runs:
        for name in run.signals:
            of_unit = by_unit.setdefault(run.units[name], [])
            if name not in run.modes and name not in of_unit and _matches(name, patterns):
                of_unit.append(name)
    panels = []
    for unit, names in by_unit.items():
        for group in _group_by_magnitude(names, runs):
            lines = [
                PlotLine(
                    name, f"{name}, {labels[k]}" if len(runs) > 1 else name, 1.0, k > 0, k, colour
                )
                for colour, name in enumerate(group)
                for k, run in enumerate(runs)
                if name in run.signals
            ]
            panels.append(Panel(axis_title(unit), lines))
    return panels


def _has_modes(run: SampledRun, name: str) -> bool:
    """Tell whether a signal is of modes, not of an automaton that has none of its own."""
    return set(run.modes.get(name, {}).values()) not in (set(), {IMPLICIT_MODE})


def _group_by_magnitude(names: Sequence[str], runs: Sequence[SampledRun]) -> list[list[str]]:
    """Return names in groups of similar size, none with more than there are colours."""
    peaks = {name: max(_peak(run, name) for run in runs) for name in names}
    groups: list[list[str]] = []
    last = 0.0
    for name in sorted(names, key=lambda name: -peaks[name]):
        if not groups or 0.0 < peaks[name] * MAX_PEAK_RATIO < last:
            groups.append([])
        groups[-1].append(name)
        last = peaks[name]
    result = []
    for group in groups:
        members = [name for name in names if name in group]
        parts = -(-len(members) // len(PALETTE))
        size = -(-len(members) // parts)
        result += [members[start : start + size] for start in range(0, len(members), size)]
    return result


def _peak(run: SampledRun, name: str) -> float:
    """Return the largest finite magnitude of a signal, 0 if there is none."""
    values = np.abs(run.signals.get(name, np.zeros(0)).astype(np.float64))
    return float(np.max(values, initial=0.0, where=np.isfinite(values)))


def axis_title(unit: str) -> str:
    """Return what is written at an axis: the quantity and its unit."""
    return f"{QUANTITIES.get(unit, '')} [{unit}]".strip()


def _matches(name: str, patterns: Sequence[str]) -> bool:
    return not patterns or any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def _require_matches(runs: Sequence[SampledRun], patterns: Sequence[str]) -> None:
    known = list(dict.fromkeys(name for run in runs for name in run.signals))
    for pattern in patterns:
        if not fnmatch.filter(known, pattern):
            hint = suggest_name(pattern, known) or f"signals: {', '.join(known)}"
            raise ValueError(f"no signal matches `{pattern}`: {hint}")


def _time_window(
    runs: Sequence[SampledRun], span: tuple[float, float] | None
) -> tuple[float, float]:
    """Return what is shown: the span, its infinite ends replaced by those of the runs [s]."""
    times = [float(run.times[k]) for run in runs if len(run.times) for k in (0, -1)]
    whole = (min(times), max(times)) if len(set(times)) > 1 else (0.0, 1.0)
    if span is None:
        return whole
    start, end = (
        given if np.isfinite(given) else own for given, own in zip(span, whole, strict=True)
    )
    return (start, end) if start < end else whole


def _draw_panel(
    axis: Axes, runs: Sequence[SampledRun], panel: Panel, window: tuple[float, float]
) -> None:
    for k, line in enumerate(panel.lines):
        run = runs[line.run]
        shown = (run.times >= window[0]) & (run.times <= window[1])
        values = run.signals[line.signal]
        colour = PALETTE[(k if line.colour is None else line.colour) % len(PALETTE)]
        style = "steps-post" if values.dtype == np.int64 else "default"
        axis.plot(
            run.times[shown], values[shown] * line.factor, "--" if line.dashed else "-",
            color=colour, lw=1.2, label=line.label, drawstyle=style,
        )  # fmt: skip
    _mark_events(axis, runs[0], window)
    axis.set_ylabel(escape_invisible(panel.title), fontsize=9, parse_math=False)
    axis.grid(alpha=0.3)


def _mark_events(axis: Axes, run: SampledRun, window: tuple[float, float]) -> None:
    """Mark when a mode became another one, not what fired and left the modes as they were."""
    times = {e.time for e in run.events if e.target not in ("", e.source)}
    instants = sorted(time for time in times if window[0] <= time <= window[1])
    for k, time in enumerate(instants[:MAX_MARKERS]):
        label = "mode changes" if k == 0 else None
        axis.axvline(time, color="black", lw=0.7, ls=":", alpha=0.55, label=label, zorder=0)
