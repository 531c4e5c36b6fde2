"""Mode band: draws the modes of one automaton as a coloured strip with names."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.patches import Patch

from engine.results.sampled_run import SampledRun, SignalArray
from language.lowering.program_builder import INACTIVE

PALETTE = ("#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#777777")
"""Colours that colour-blind readers can distinguish (Tol 2021, bright)."""
INACTIVE_COLOUR = "#dddddd"
"""Colour of a region while none of its modes is active."""
LIGHTEN_SHARE, DARKEN_SHARE = 0.55, 0.45
"""Shares of white and of black by which the palette is extended for more modes."""
BLACK_TEXT_BRIGHTNESS = 0.6
"""Brightness above which a name is written in black."""
BORDER_WIDTH = 0.8
"""Width of the line between two segments, at most a quarter of a segment [points]."""
LABEL_FILL = 0.94
"""Largest share of a segment that its name may fill."""


@dataclass(frozen=True)
class ModeBand:
    """Strip of a plot: its label, the mode signal, and the index of its run."""

    label: str
    signal: str
    run: int = 0


@dataclass(frozen=True)
class ModeSegment:
    """Time interval [s] in one mode, clipped to the shown window, with its colour."""

    start: float
    end: float
    name: str
    colour: str


def draw_band(
    axis: Axes, trajectory: SampledRun, band: ModeBand, window: tuple[float, float]
) -> list[ModeSegment]:
    """Draw a strip with a legend of all shown modes; return its segments for `label_segments`.

    A segment is an interval of constant mode; those outside `window`, the shown time [s], are left
    out. A number without a name is shown as the number.
    """
    names = trajectory.modes[band.signal]
    runs = _equal_mode_runs(trajectory.times, trajectory.signals[band.signal])
    colours = _assign_colours(names, [number for *_, number in runs])
    width = 72.0 * axis.figure.get_figure(root=True).get_figwidth() / (window[1] - window[0])
    segments = []
    for start, end, number in runs:
        left, right = max(start, window[0]), min(end, window[1])
        if right <= left and start != end:
            continue
        colour = colours[number]
        border = min(BORDER_WIDTH, 0.25 * (right - left) * width)
        axis.axvspan(start, end, facecolor=colour, edgecolor="white", lw=border)
        segments.append(ModeSegment(left, right, names.get(number, str(number)), colour))
    _draw_legend(axis, {segment.name: segment.colour for segment in segments})
    axis.set_yticks([0.5], [band.label], fontsize=8)
    axis.set_ylim(0.0, 1.0)
    axis.tick_params(length=0, labelbottom=False)
    for side in axis.spines.values():
        side.set_visible(False)
    return segments


def label_segments(axis: Axes, segments: Sequence[ModeSegment]) -> None:
    """Write the names of modes into segments that are wide enough.

    A name may fill `LABEL_FILL` of its segment. The legend keeps the modes that are written
    nowhere. The layout of the axes has to be complete, because text widths are measured.
    """
    left, right = axis.get_xlim()
    points_per_second = LABEL_FILL * axis.get_window_extent().width / (right - left)
    labelled = set()
    widths: dict[str, float] = {}
    for segment in segments:
        text = axis.text(
            0.5 * (segment.start + segment.end), 0.5, segment.name, fontsize=8,
            ha="center", va="center", color=_text_colour(segment.colour), parse_math=False,
        )  # fmt: skip
        if segment.name not in widths:
            widths[segment.name] = text.get_window_extent().width
        if widths[segment.name] <= points_per_second * (segment.end - segment.start):
            labelled.add(segment.name)
        else:
            text.remove()
    _draw_legend(axis, {each.name: each.colour for each in segments if each.name not in labelled})


def _assign_colours(names: Mapping[int, str], sequence: Sequence[int]) -> dict[int, str]:
    """Return a colour for each mode number; consecutive modes have different colours if possible.

    `sequence` has the mode numbers in order of time. Inactive modes are grey.
    """
    wheel = [
        *PALETTE,
        *(_mix_colour(colour, 1.0, LIGHTEN_SHARE) for colour in PALETTE),
        *(_mix_colour(colour, 0.0, DARKEN_SHARE) for colour in PALETTE),
    ]
    neighbours: dict[int, set[int]] = {}
    for first, second in itertools.pairwise(sequence):
        neighbours.setdefault(first, set()).add(second)
        neighbours.setdefault(second, set()).add(first)
    assigned: dict[int, str] = {}
    numbers = sorted({*names, *sequence})
    active = [number for number in numbers if names.get(number) != INACTIVE]
    for k, number in enumerate(active):
        used = {assigned[other] for other in neighbours.get(number, ()) if other in assigned}
        rotated = wheel[k % len(wheel) :] + wheel[: k % len(wheel)]
        assigned[number] = next((colour for colour in rotated if colour not in used), rotated[0])
    return dict.fromkeys(numbers, INACTIVE_COLOUR) | assigned


def _mix_colour(colour: str, brightness: float, share: float) -> str:
    """Return a colour mixed with white (`brightness` 1) or black (0); `share` is their share."""
    red, green, blue = ((1.0 - share) * part + share * brightness for part in to_rgb(colour))
    return to_hex((red, green, blue))


def _text_colour(colour: str) -> str:
    """Return black for bright backgrounds, else white."""
    red, green, blue = to_rgb(colour)
    return "black" if 0.3 * red + 0.59 * green + 0.11 * blue > BLACK_TEXT_BRIGHTNESS else "white"


def _draw_legend(axis: Axes, colours: dict[str, str]) -> None:
    """Replace the legend of an axis; without colours there is none."""
    old_legend = axis.get_legend()
    if old_legend:
        old_legend.remove()
    if colours:
        patches = [Patch(color=colour, label=name) for name, colour in colours.items()]
        axis.legend(
            handles=patches, loc="center left", bbox_to_anchor=(1.0, 0.5), ncols=3, fontsize=7,
            frameon=False, handlelength=1.0, columnspacing=0.8, borderpad=0.0, labelspacing=0.1,
        )  # fmt: skip


def _equal_mode_runs(times: SignalArray, modes: SignalArray) -> list[tuple[float, float, int]]:
    """Return maximal intervals of constant mode as start [s], end [s] and mode number."""
    if len(times) == 0:
        return []
    changes = np.flatnonzero(np.diff(modes)) + 1
    starts = np.concatenate(([0], changes))
    ends = np.concatenate((changes, [len(times) - 1]))
    return [
        (float(times[a]), float(times[b]), int(modes[a])) for a, b in zip(starts, ends, strict=True)
    ]
