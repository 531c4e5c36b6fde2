"""Band: the modes of one automaton as a coloured strip, each stretch named."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.patches import Patch

from engine.trajectory import Trajectory, Values
from language.wiring import INACTIVE

PALETTE = ("#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#777777")
"""Colours that colour-blind readers tell apart (Tol 2021, bright)."""
INACTIVE_COLOUR = "#dddddd"
"""Of a region that is in none of its modes, which is no mode of its own."""
LIGHT, DARK = 0.55, 0.45
"""By how much the palette is mixed with white, then with black, for more modes than colours."""
LIGHTEST = 0.6
"""Brightness from which a name is written in black."""
BORDER = 0.8
"""Width of the line between two stretches, at most a quarter of a stretch [points]."""
ROOM = 0.94
"""The part of a stretch that its name may fill."""


@dataclass(frozen=True)
class Band:
    """One strip: its label, the mode signal, and the run that it is of."""

    label: str
    signal: str
    run: int = 0


@dataclass(frozen=True)
class Stretch:
    """A time in one mode [s], as far as it is shown."""

    start: float
    end: float
    name: str
    colour: str


def draw_band(
    axis: Axes, trajectory: Trajectory, band: Band, window: tuple[float, float]
) -> list[Stretch]:
    """Draw a strip with a legend of all its modes; return what `name_stretches` names."""
    names = trajectory.modes[band.signal]
    runs = _runs(trajectory.times, trajectory.signals[band.signal])
    colours = _colours(names, [number for *_, number in runs])
    width = 72.0 * axis.figure.get_figure(root=True).get_figwidth() / (window[1] - window[0])
    found = []
    for start, end, number in runs:
        left, right = max(start, window[0]), min(end, window[1])
        if right <= left and start != end:
            continue
        colour = colours[number]
        border = min(BORDER, 0.25 * (right - left) * width)
        axis.axvspan(start, end, facecolor=colour, edgecolor="white", lw=border)
        found.append(Stretch(left, right, names.get(number, str(number)), colour))
    _legend(axis, {stretch.name: stretch.colour for stretch in found})
    axis.set_yticks([0.5], [band.label], fontsize=8)
    axis.set_ylim(0.0, 1.0)
    axis.tick_params(length=0, labelbottom=False)
    for side in axis.spines.values():
        side.set_visible(False)
    return found


def name_stretches(axis: Axes, stretches: Sequence[Stretch]) -> None:
    """Name the stretches into which their name fits whole; the legend keeps the other modes.

    The axes must have their places: the legend can only become narrower.
    """
    left, right = axis.get_xlim()
    room = ROOM * axis.get_window_extent().width / (right - left)
    named = set()
    widths: dict[str, float] = {}
    for stretch in stretches:
        text = axis.text(
            0.5 * (stretch.start + stretch.end), 0.5, stretch.name, fontsize=8,
            ha="center", va="center", color=_ink(stretch.colour), parse_math=False,
        )  # fmt: skip
        if stretch.name not in widths:
            widths[stretch.name] = text.get_window_extent().width
        if widths[stretch.name] <= room * (stretch.end - stretch.start):
            named.add(stretch.name)
        else:
            text.remove()
    _legend(axis, {each.name: each.colour for each in stretches if each.name not in named})


def _colours(names: Mapping[int, str], shown: Sequence[int]) -> dict[int, str]:
    """Return a colour for each mode; those that follow each other have never the same one."""
    wheel = [
        *PALETTE,
        *(_mixed(colour, 1.0, LIGHT) for colour in PALETTE),
        *(_mixed(colour, 0.0, DARK) for colour in PALETTE),
    ]
    beside: dict[int, set[int]] = {}
    for one, other in itertools.pairwise(shown):
        beside.setdefault(one, set()).add(other)
        beside.setdefault(other, set()).add(one)
    found: dict[int, str] = {}
    numbers = sorted({*names, *shown})
    active = [number for number in numbers if names.get(number) != INACTIVE]
    for k, number in enumerate(active):
        taken = {found[other] for other in beside.get(number, ()) if other in found}
        turned = wheel[k % len(wheel) :] + wheel[: k % len(wheel)]
        found[number] = next((colour for colour in turned if colour not in taken), turned[0])
    return dict.fromkeys(numbers, INACTIVE_COLOUR) | found


def _mixed(colour: str, other: float, share: float) -> str:
    """Return a colour mixed with white, 1, or black, 0."""
    red, green, blue = ((1.0 - share) * part + share * other for part in to_rgb(colour))
    return to_hex((red, green, blue))


def _ink(colour: str) -> str:
    red, green, blue = to_rgb(colour)
    return "black" if 0.3 * red + 0.59 * green + 0.11 * blue > LIGHTEST else "white"


def _legend(axis: Axes, colours: dict[str, str]) -> None:
    before = axis.get_legend()
    if before:
        before.remove()
    if colours:
        patches = [Patch(color=colour, label=name) for name, colour in colours.items()]
        axis.legend(
            handles=patches, loc="center left", bbox_to_anchor=(1.0, 0.5), ncols=3, fontsize=7,
            frameon=False, handlelength=1.0, columnspacing=0.8, borderpad=0.0, labelspacing=0.1,
        )  # fmt: skip


def _runs(times: Values, modes: Values) -> list[tuple[float, float, int]]:
    """Return the stretches of equal mode as start, end, number."""
    if len(times) == 0:
        return []
    changes = np.flatnonzero(np.diff(modes)) + 1
    starts = np.concatenate(([0], changes))
    ends = np.concatenate((changes, [len(times) - 1]))
    return [
        (float(times[a]), float(times[b]), int(modes[a])) for a, b in zip(starts, ends, strict=True)
    ]
