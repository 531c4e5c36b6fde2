"""Replay figure: draw measured inputs, estimated outputs and mode of a replay."""

from __future__ import annotations

import numpy as np

from engine.results.mode_band import ModeBand
from engine.results.plot import Panel, PlotLine, axis_title, draw_picture
from engine.results.trajectory import Trajectory
from modewright.api.simulation import Replayed


def replay_picture(replayed: Replayed, title: str, form: str = "png") -> bytes:
    """Return a figure of a replay as bytes in the format `form` (`png`, `svg` or `pdf`).

    It has a panel for each unit of the measured signals, then one for each unit of the outputs, and
    the band of the mode. Signals that are not real are left out.
    """
    trajectory = replayed.result.trajectory
    panels = [*_panels(trajectory, measured=True), *_panels(trajectory, measured=False)]
    return draw_picture([trajectory], panels, [ModeBand("mode", "mode")], title).data(form)


def _panels(trajectory: Trajectory, *, measured: bool) -> list[Panel]:
    """Return the panels of the measured or of the estimated signals."""
    by_unit: dict[str, list[str]] = {}
    for name, values in trajectory.signals.items():
        if values.dtype == np.float64 and name.startswith("in.") == measured:
            by_unit.setdefault(trajectory.units[name], []).append(name)
    word = "measured" if measured else "estimated"
    return [
        Panel(
            f"{word} {axis_title(unit)}",
            [PlotLine(name, name.removeprefix("in.")) for name in names],
        )
        for unit, names in by_unit.items()
    ]
