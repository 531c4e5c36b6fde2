"""Missing picture: the unknown torque, force or error that a recording asks for, over its time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from diagnosis.locus import SIGNIFICANT_STDS, DisturbanceEstimate, Location
from diagnosis.series import SampledRecording
from engine.results.mode_band import PALETTE
from engine.results.plot import Picture
from language.text.sanitise import escape_invisible

_, RED, GREEN, _, _, PURPLE, GREY = PALETTE
MAX_INPUTS = 3


def draw_disturbance(
    location: Location,
    series: SampledRecording,
    disturbance: DisturbanceEstimate,
    title: str,
    unit: str,
    inputs: Mapping[str, str],
) -> Picture:
    """Return the picture of what is `disturbance` in a recording, give or take what makes a window.

    `title` it is and its `unit` are told; beneath stand those of the `inputs` (names with units)
    that move, in the unit of the first.
    """
    values, reach = disturbance.values, SIGNIFICANT_STDS * disturbance.stds
    first = series.count - len(values)
    times = float(series.start) + np.arange(first, series.count) * float(series.period)
    moving = [k for k in range(len(inputs)) if float(np.ptp(series.inputs[:, k])) > 0.0]
    names, units = list(inputs), list(inputs.values())
    moving = [k for k in moving if units[k] == units[moving[0]]][:MAX_INPUTS]
    figure = Figure(figsize=(8.5, 4.2 if moving else 2.8), layout="constrained")
    heights = [1.7, 1.0] if moving else [1.7]
    rows = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)
    above, beneath = rows[0][0], rows[-1][0]
    above.fill_between(times, values - reach, values + reach, color=GREY, alpha=0.3, lw=0)
    above.plot(times, values, color=RED, lw=1.2)
    above.axhline(0.0, color="black", lw=0.6)
    for start, end, name in location.windows:
        if name == series.name:
            above.axvspan(start, end, color=RED, alpha=0.12, lw=0)
    above.set_ylabel(escape_invisible(f"{title} [{unit}]"), fontsize=9, parse_math=False)
    above.set_title(escape_invisible(series.name), loc="left", fontsize=10, parse_math=False)
    for k, colour in zip(moving, (GREEN, PURPLE, GREY), strict=False):
        beneath.plot(
            times, series.inputs[first:, k], color=colour, lw=1.1, label=escape_invisible(names[k])
        )
    if moving:
        beneath.set_ylabel(
            escape_invisible(f"inputs [{units[moving[0]]}]"), fontsize=8, parse_math=False
        )
        beneath.legend(loc="best", fontsize=8)
    for axis in (above, beneath):
        axis.grid(alpha=0.3)
        axis.tick_params(labelsize=8)
    beneath.set_xlabel("time [s]; red: where something is missing for sure", fontsize=9)
    return Picture(figure)
