"""Plot: draws runs with modes as coloured bands above the signals, and marks mode changes."""

from __future__ import annotations

import fnmatch
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from engine.results.mode_band import PALETTE, ModeBand, draw_band, label_segments
from engine.results.picture_format import PICTURE_FORMATS, picture_format
from engine.results.sampled_run import SampledRun, matches_any
from language.readers.mode_reader import IMPLICIT_MODE
from language.text.arguments import PathText, to_choice, to_path
from language.text.diagnostic import suggest_name
from language.text.sanitise import escape_invisible

QUANTITIES = {
    "1": "number", "A": "current", "K": "temperature", "N": "force", "N*m": "torque",
    "Pa": "pressure", "V": "voltage", "W": "power", "m": "length", "m/s": "speed",
    "m/s^2": "acceleration", "rad": "angle", "rad/s": "angular speed",
    "rad/s^2": "angular acceleration", "s": "time",
}  # fmt: skip
"""Name of the quantity that an axis shows for a unit."""
MAX_PEAK_RATIO = 6.0
"""Ratio of peaks above which the next smaller signal gets a panel of its own.

In the panel of the larger one it would look flat.
"""
MAX_MARKERS = 200
"""Largest number of mode changes marked in a panel; more lines would merge.

Of more changes every second, third, ... is marked, and the legend says so.
"""


@dataclass(frozen=True)
class PlotLine:
    """Curve of a panel: signal, label, factor to the shown unit, and index of its run.

    `colour` is an index of the palette; None means the position in the panel.
    """

    signal: str
    label: str
    factor: float = 1.0
    dashed: bool = False
    run: int = 0
    colour: int | None = None


@dataclass(frozen=True)
class Panel:
    """Curves that share an axis; `height` is in inches."""

    title: str
    lines: Sequence[PlotLine]
    height: float = 2.0


@dataclass(frozen=True)
class Picture:
    """Drawn figure that a notebook displays and that can be saved."""

    figure: Figure

    def data(self, form: str = "png") -> bytes:
        """Return the picture as bytes of a format in PICTURE_FORMATS; `png` has 130 dpi.

        The bytes have no date. Raises ValueError for another format; it names the formats.
        """
        to_choice(form, PICTURE_FORMATS, "form")
        buffer = io.BytesIO()
        metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(form, {})
        with matplotlib.rc_context({"svg.hashsalt": "modewright"}):
            self.figure.savefig(buffer, format=form, dpi=130, metadata=metadata)
        return buffer.getvalue()

    def save(self, path: PathText) -> None:
        """Write the picture to a file, replacing it; its suffix gives the format.

        Raises ValueError for a suffix of no format in PICTURE_FORMATS.
        """
        file = to_path(path, "path")
        try:
            form = picture_format(file)
        except ValueError as error:
            raise ValueError(f"`path` is {error}") from None
        file.write_bytes(self.data(form))

    def _repr_png_(self) -> bytes:
        """Return the picture as PNG for a notebook."""
        return self.data()


def draw_picture(
    runs: Sequence[SampledRun],
    panels: Sequence[Panel],
    bands: Sequence[ModeBand],
    title: str,
    span: tuple[float, float] | None = None,
    shaded: Sequence[tuple[float, float]] = (),
) -> Picture:
    """Return a picture of bands and panels, one below the other, over a common axis of time [s].

    `span` is the shown time, without it that of all runs; an infinite end is that of the runs. The
    windows `shaded` [s] are drawn red behind the panels. Dotted lines in each panel mark the mode
    changes of the first run, at most `MAX_MARKERS` of them.
    """
    heights = [0.28] * len(bands) + [panel.height for panel in panels] or [1.0]
    figure = Figure(figsize=(9.0, 1.2 + sum(heights)), layout="constrained")
    rows = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)
    axes = [row[0] for row in rows]
    window = _time_window(runs, span)
    segments_by_band = [
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
    if any(segments_by_band):
        figure.draw_without_rendering()  # widths of labels are known after the layout
    for axis, segments in zip(axes, segments_by_band, strict=False):
        label_segments(axis, segments)
    return Picture(figure)


def draw_overview(
    runs: Sequence[SampledRun],
    patterns: Sequence[str] = (),
    span: tuple[float, float] | None = None,
    title: str = "",
    labels: Sequence[str] = ("A", "B"),
) -> Picture:
    """Return a picture of one run or two, of all signals or those that match a pattern.

    Patterns are those of fnmatch, with case. Mode signals of more than the implicit mode are bands,
    others panels (`panels_by_unit`). Lines of the second run are dashed in the colours of the
    first, and names get `labels`. The title is `title`, else the names of the runs. Raises
    ValueError if a pattern matches no signal, and if no sample lies in `span`.
    """
    _require_matches(runs, patterns)
    _require_samples(runs, span)
    two = len(runs) > 1
    bands = [
        ModeBand(name.removesuffix(".mode") + (f", {labels[run]}" if two else ""), name, run)
        for name in dict.fromkeys(name for each in runs for name in each.modes)
        for run, each in enumerate(runs)
        if name in each.signals and matches_any(name, patterns) and _has_modes(each, name)
    ]
    title = title or " and ".join(dict.fromkeys(run.name for run in runs))
    return draw_picture(runs, panels_by_unit(runs, patterns, labels), bands, title, span)


def panels_by_unit(
    runs: Sequence[SampledRun], patterns: Sequence[str] = (), labels: Sequence[str] = ("A", "B")
) -> list[Panel]:
    """Return panels that group the signals that match a pattern by unit and by size.

    Units come in the order of the signals. Of one unit, a signal whose peak is more than
    `MAX_PEAK_RATIO` times below the next larger one starts another panel, and so does one beyond
    the size of the palette. Mode signals are left out. A signal in several runs has one line for
    each, with the label `<signal>, <label>`; all but those of the first run are dashed.
    """
    by_unit: dict[str, list[str]] = {}
    for run in runs:
        for name in run.signals:
            of_unit = by_unit.setdefault(run.units[name], [])
            if name not in run.modes and name not in of_unit and matches_any(name, patterns):
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
    """Return whether a signal is a mode signal with more than the implicit mode."""
    return set(run.modes.get(name, {}).values()) not in (set(), {IMPLICIT_MODE})


def _group_by_magnitude(names: Sequence[str], runs: Sequence[SampledRun]) -> list[list[str]]:
    """Return names in groups of similar peak values, each at most as large as the palette.

    A group ends where the next peak is more than `MAX_PEAK_RATIO` times smaller; zero signals join
    a group.
    """
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
    """Return the largest finite magnitude of a signal; 0 if there is none."""
    values = np.abs(run.signals.get(name, np.zeros(0)).astype(np.float64))
    return float(np.max(values, initial=0.0, where=np.isfinite(values)))


def axis_title(unit: str) -> str:
    """Return the title of an axis, `quantity [unit]`; `[unit]` if `QUANTITIES` lacks the unit."""
    return f"{QUANTITIES.get(unit, '')} [{unit}]".strip()


def _require_matches(runs: Sequence[SampledRun], patterns: Sequence[str]) -> None:
    """Raise ValueError for a pattern that matches no signal."""
    known = list(dict.fromkeys(name for run in runs for name in run.signals))
    for pattern in patterns:
        if not fnmatch.filter(known, pattern):
            hint = suggest_name(pattern, known) or f"the signals are {', '.join(known)}"
            raise ValueError(f"no signal matches `{pattern}`: {hint}")


def _require_samples(runs: Sequence[SampledRun], span: tuple[float, float] | None) -> None:
    """Raise ValueError if the runs have samples, but none of them lies in a span [s]."""
    times = np.concatenate([run.times for run in runs])
    if span and len(times) and not np.any((times >= span[0]) & (times <= span[1])):
        covered = f"they cover {np.min(times):g} s to {np.max(times):g} s"
        raise ValueError(f"no sample lies in {span[0]:g} s to {span[1]:g} s: {covered}")


def _time_window(
    runs: Sequence[SampledRun], span: tuple[float, float] | None
) -> tuple[float, float]:
    """Return the shown time [s]: the span, with infinite ends replaced by those of the runs.

    An empty span or None gives the whole time of the runs, and runs without samples (0, 1).
    """
    times = [float(run.times[k]) for run in runs if len(run.times) for k in (0, -1)]
    whole = (min(times), max(times)) if len(set(times)) > 1 else (0.0, 1.0)
    if span is None:
        return whole
    start, end = (end if np.isfinite(end) else own for end, own in zip(span, whole, strict=True))
    return (start, end) if start < end else whole


def _draw_panel(
    axis: Axes, runs: Sequence[SampledRun], panel: Panel, window: tuple[float, float]
) -> None:
    """Draw the curves of a panel within a window [s].

    Integer signals and signals that are piecewise constant are drawn as steps.
    """
    for k, line in enumerate(panel.lines):
        run = runs[line.run]
        shown = (run.times >= window[0]) & (run.times <= window[1])
        values = run.signals[line.signal]
        colour = PALETTE[(k if line.colour is None else line.colour) % len(PALETTE)]
        has_steps = values.dtype == np.int64 or line.signal in run.piecewise_constant
        style = "steps-post" if has_steps else "default"
        axis.plot(
            run.times[shown], values[shown] * line.factor, "--" if line.dashed else "-",
            color=colour, lw=1.2, label=line.label, drawstyle=style,
        )  # fmt: skip
    _mark_events(axis, runs[0], window)
    axis.set_ylabel(escape_invisible(panel.title), fontsize=9, parse_math=False)
    axis.grid(alpha=0.3)


def _mark_events(axis: Axes, run: SampledRun, window: tuple[float, float]) -> None:
    """Mark the times of mode changes by dotted lines, at most `MAX_MARKERS` over the whole window.

    Of more changes every n-th is marked, and the legend states n and the number of changes. Events
    that leave the mode unchanged are not marked.
    """
    times = {e.time for e in run.events if e.target not in ("", e.source)}
    instants = sorted(time for time in times if window[0] <= time <= window[1])
    stride = max(1, math.ceil(len(instants) / MAX_MARKERS))
    text = "mode changes" if stride == 1 else f"mode changes, 1 of {stride} ({len(instants)})"
    for k, time in enumerate(instants[::stride]):
        label = text if k == 0 else None
        axis.axvline(time, color="black", lw=0.7, ls=":", alpha=0.55, label=label, zorder=0)
