"""Band: the modes of one automaton as a coloured strip, each stretch named."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from engine.trajectory import Trajectory, Values
from language.wiring import INACTIVE

PALETTE = ("#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#777777")
"""Colours that colour-blind readers tell apart (Tol 2021, bright)."""
INACTIVE_COLOUR = "#dddddd"
"""Of a region that is in none of its modes, which is no mode of its own."""
CHARACTER = 0.075
"""Width of a character at 8 points, with room [inch]."""


@dataclass(frozen=True)
class Band:
    """One strip: its label, the mode signal, and the run that it is of."""

    label: str
    signal: str
    run: int = 0


def draw_band(axis: Axes, trajectory: Trajectory, band: Band, window: tuple[float, float]) -> None:
    """Draw a strip; modes whose stretches are too short for a name are named beside it."""
    names = trajectory.modes[band.signal]
    active = sorted(number for number in names if names[number] != INACTIVE)
    colours = {number: PALETTE[k % len(PALETTE)] for k, number in enumerate(active)}
    colours |= dict.fromkeys(set(names) - set(active), INACTIVE_COLOUR)
    room = 0.72 * axis.figure.get_figure(root=True).get_figwidth() / (window[1] - window[0])
    short = {}
    named = set()
    for start, end, number in _stretches(trajectory.times, trajectory.signals[band.signal]):
        left, right = max(start, window[0]), min(end, window[1])
        if right <= left and start != end:
            continue
        colour, name = colours.get(number, PALETTE[-1]), names.get(number, str(number))
        axis.axvspan(start, end, color=colour, alpha=0.75, lw=0)
        short[name] = colour
        if (right - left) * room > CHARACTER * len(name):
            ink = "black" if colour == INACTIVE_COLOUR else "white"
            axis.text(
                0.5 * (left + right), 0.5, name, ha="center", va="center", fontsize=8, color=ink
            )
            named.add(name)
    _legend(axis, {name: colour for name, colour in short.items() if name not in named})
    axis.set_yticks([0.5], [band.label], fontsize=8)
    axis.set_ylim(0.0, 1.0)
    axis.tick_params(length=0, labelbottom=False)
    for side in axis.spines.values():
        side.set_visible(False)


def _legend(axis: Axes, colours: dict[str, str]) -> None:
    if colours:
        patches = [Patch(color=colour, alpha=0.75, label=name) for name, colour in colours.items()]
        axis.legend(
            handles=patches, loc="center left", bbox_to_anchor=(1.0, 0.5), ncols=3, fontsize=7,
            frameon=False, handlelength=1.0, columnspacing=0.8, borderpad=0.0, labelspacing=0.1,
        )  # fmt: skip


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
