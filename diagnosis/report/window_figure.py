"""Window figure: a window as recorded and as simulated, with the error of the simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from diagnosis.data.array_types import Reals
from diagnosis.validation.worst_window import WorstWindow
from engine.results.mode_band import PALETTE
from engine.results.plot import Picture
from language.text.sanitise import escape_invisible

BLUE, RED, GREEN, _, _, PURPLE, GREY = PALETTE
INPUT_COLOURS = (GREEN, PURPLE, GREY)


def draw_window(window: WorstWindow, inputs: Mapping[str, str], is_base_only: bool) -> Picture:
    """Draw the varying inputs of one unit, and values and errors of each signal.

    `inputs` are names with units; the time under the observer is grey. With `is_base_only` only the
    base is drawn.
    """
    driven = moving_inputs(window.inputs, inputs)
    count = len(window.signals)
    heights = [1.0] * bool(driven) + [1.7, 1.0] * count
    figure = Figure(figsize=(8.5, 0.9 + 0.82 * sum(heights)), layout="constrained")
    rows = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)
    axes = [row[0] for row in rows]
    if driven:
        names, unit = list(inputs), inputs[list(inputs)[driven[0]]]
        draw_inputs(axes[0], window.times, window.inputs, names, driven)
        set_ylabel(axes[0], f"{names[driven[0]] if len(driven) == 1 else 'inputs'} [{unit}]", 8)
        if len(driven) > 1:
            axes[0].legend(loc="best", fontsize=8)
    for k in range(count):
        first = bool(driven) + 2 * k
        _draw_signal(axes[first], axes[first + 1], window, k, is_base_only)
    for axis in axes:
        axis.grid(alpha=0.3)
        axis.axvspan(window.times[0], window.free_from, color="#999999", alpha=0.15, lw=0)
        axis.tick_params(labelsize=8)
    axes[bool(driven)].legend(loc="best", fontsize=8)
    set_title(axes[0], window.title[0].upper() + window.title[1:])
    axes[-1].set_xlabel("time [s]; grey: an observer follows, then the model is alone", fontsize=9)
    return Picture(figure)


def set_ylabel(axis: Axes, text: str, fontsize: int = 9) -> None:
    """Write a text beside an axis, as it is."""
    axis.set_ylabel(escape_invisible(text), fontsize=fontsize, parse_math=False)


def set_title(axis: Axes, text: str, fontsize: int = 10) -> None:
    """Write a text above an axis, as it is."""
    axis.set_title(escape_invisible(text), loc="left", fontsize=fontsize, parse_math=False)


def moving_inputs(values: Reals, inputs: Mapping[str, str]) -> list[int]:
    """Return the columns of up to three varying inputs (samples, inputs) with one unit."""
    moving = [k for k in range(len(inputs)) if float(np.ptp(values[:, k])) > 0.0]
    units = list(inputs.values())
    return [k for k in moving if units[k] == units[moving[0]]][: len(INPUT_COLOURS)]


def draw_inputs(
    axis: Axes, times: Reals, values: Reals, names: Sequence[str], columns: Sequence[int]
) -> None:
    """Draw some columns of inputs (samples, inputs) over time."""
    for k, colour in zip(columns, INPUT_COLOURS, strict=False):
        axis.plot(times, values[:, k], color=colour, lw=1.1, label=escape_invisible(names[k]))


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
    set_ylabel(above, f"{name} [{unit}]")
    set_ylabel(beneath, f"missed [{unit}]", 8)
