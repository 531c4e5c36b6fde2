"""Window figure: a window as recorded and as simulated, with the error of the simulation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from diagnosis.validation.worst_window import WorstWindow
from engine.results.mode_band import PALETTE
from engine.results.plot import Picture
from language.text.sanitise import escape_invisible

BLUE, RED, GREEN, _, _, PURPLE, GREY = PALETTE
MAX_INPUTS = 3


def draw_window(window: WorstWindow, inputs: Mapping[str, str], is_base_only: bool) -> Picture:
    """Draw the varying inputs of one unit, and values and errors of each signal.

    `inputs` are names with units; the time under the observer is grey. With `is_base_only` only the
    base is drawn.
    """
    driven = _moving_inputs(window, inputs)
    count = len(window.signals)
    heights = [1.0] * bool(driven) + [1.7, 1.0] * count
    figure = Figure(figsize=(8.5, 0.9 + 0.82 * sum(heights)), layout="constrained")
    rows = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)
    axes = [row[0] for row in rows]
    if driven:
        _draw_inputs(axes[0], window, inputs, driven)
    for k in range(count):
        first = bool(driven) + 2 * k
        _draw_signal(axes[first], axes[first + 1], window, k, is_base_only)
    for axis in axes:
        axis.grid(alpha=0.3)
        axis.axvspan(window.times[0], window.free_from, color="#999999", alpha=0.15, lw=0)
        axis.tick_params(labelsize=8)
    axes[bool(driven)].legend(loc="best", fontsize=8)
    text = escape_invisible(window.title[0].upper() + window.title[1:])
    axes[0].set_title(text, loc="left", fontsize=10, parse_math=False)
    axes[-1].set_xlabel("time [s]; grey: an observer follows, then the model is alone", fontsize=9)
    return Picture(figure)


def _moving_inputs(window: WorstWindow, inputs: Mapping[str, str]) -> list[int]:
    """Return the indices of up to three varying inputs with the unit of the first one."""
    moving = [k for k in range(len(inputs)) if float(np.ptp(window.inputs[:, k])) > 0.0]
    units = list(inputs.values())
    return [k for k in moving if units[k] == units[moving[0]]][:MAX_INPUTS]


def _draw_inputs(
    axis: Axes, window: WorstWindow, inputs: Mapping[str, str], driven: list[int]
) -> None:
    """Draw inputs over time."""
    names, units = list(inputs), list(inputs.values())
    for k, colour in zip(driven, (GREEN, PURPLE, GREY), strict=False):
        axis.plot(
            window.times,
            window.inputs[:, k],
            color=colour,
            lw=1.1,
            label=escape_invisible(names[k]),
        )
    text = f"{names[driven[0]] if len(driven) == 1 else 'inputs'} [{units[driven[0]]}]"
    axis.set_ylabel(escape_invisible(text), fontsize=8, parse_math=False)
    if len(driven) > 1:
        axis.legend(loc="best", fontsize=8)


def _draw_signal(
    above: Axes, beneath: Axes, window: WorstWindow, k: int, is_base_only: bool
) -> None:
    """Draw a signal as recorded and simulated, and the errors below."""
    known = np.isfinite(window.measured[:, k])
    times, measured = window.times[known], window.measured[known, k]
    above.plot(times, measured, color="black", alpha=0.3, lw=5.0, label="recorded")
    runs = [(window.before, RED, "simulated, recalibrated", "-")]
    if not is_base_only:
        runs = [(window.before, RED, "simulated without the effect", "--")]
        runs.append((window.after, BLUE, "simulated with it", "-"))
    for values, colour, label, style in runs:
        above.plot(window.times, values[:, k], style, color=colour, lw=1.4, label=label)
        beneath.plot(times, measured - values[known, k], style, color=colour, lw=1.1)
    beneath.axhline(0.0, color="black", lw=0.6)
    name, unit = window.signals[k], window.units[k]
    above.set_ylabel(escape_invisible(f"{name} [{unit}]"), fontsize=9, parse_math=False)
    beneath.set_ylabel(escape_invisible(f"missed [{unit}]"), fontsize=8, parse_math=False)
