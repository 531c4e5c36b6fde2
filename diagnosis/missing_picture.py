"""Missing picture: the unknown torque, force or error that a recording asks for, over its time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from diagnosis.locus import SURE, Locus, Unknown
from diagnosis.series import Series
from engine.band import PALETTE
from engine.plot import Picture
from language.text import visible

_, RED, GREEN, _, _, PURPLE, GREY = PALETTE
MOST_INPUTS = 3


def missing_picture(
    locus: Locus, one: Series, unknown: Unknown, what: str, unit: str, inputs: Mapping[str, str]
) -> Picture:
    """Return the picture of what is `unknown` in a recording, give or take what makes a window.

    `what` it is and its `unit` are told; beneath stand those of the `inputs` (names with units)
    that move, in the unit of the first.
    """
    values, reach = unknown.values, SURE * unknown.stds
    first = one.count - len(values)
    times = float(one.start) + np.arange(first, one.count) * float(one.period)
    moving = [k for k in range(len(inputs)) if float(np.ptp(one.inputs[:, k])) > 0.0]
    names, units = list(inputs), list(inputs.values())
    moving = [k for k in moving if units[k] == units[moving[0]]][:MOST_INPUTS]
    figure = Figure(figsize=(8.5, 4.2 if moving else 2.8), layout="constrained")
    heights = [1.7, 1.0] if moving else [1.7]
    rows = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)
    above, beneath = rows[0][0], rows[-1][0]
    above.fill_between(times, values - reach, values + reach, color=GREY, alpha=0.3, lw=0)
    above.plot(times, values, color=RED, lw=1.2)
    above.axhline(0.0, color="black", lw=0.6)
    for start, end, name in locus.windows:
        if name == one.name:
            above.axvspan(start, end, color=RED, alpha=0.12, lw=0)
    above.set_ylabel(visible(f"{what} [{unit}]"), fontsize=9, parse_math=False)
    above.set_title(visible(one.name), loc="left", fontsize=10, parse_math=False)
    for k, colour in zip(moving, (GREEN, PURPLE, GREY), strict=False):
        beneath.plot(times, one.inputs[first:, k], color=colour, lw=1.1, label=visible(names[k]))
    if moving:
        beneath.set_ylabel(visible(f"inputs [{units[moving[0]]}]"), fontsize=8, parse_math=False)
        beneath.legend(loc="best", fontsize=8)
    for axis in (above, beneath):
        axis.grid(alpha=0.3)
        axis.tick_params(labelsize=8)
    beneath.set_xlabel("time [s]; red: where something is missing for sure", fontsize=9)
    return Picture(figure)
