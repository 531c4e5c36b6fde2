"""Shuffle picture: the frequency of each cycle over its amplitude, as recorded and as simulated."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from diagnosis.shuffle import Oscillation
from engine.results.mode_band import PALETTE
from engine.results.plot import Picture
from language.text.sanitise import escape_invisible

BLUE, RED, *_ = PALETTE
LABELS = ("simulated, recalibrated", "simulated, with what was found")


def draw_oscillation(oscillations: Sequence[Oscillation], unit: str) -> Picture:
    """Return the cycles of a recording and of one or two models of it; `unit` of the signal."""
    figure = Figure(figsize=(7.0, 3.2), layout="constrained")
    axis = figure.subplots()
    first = oscillations[0]
    axis.semilogx(first.recorded.amplitudes, first.recorded.frequencies, "o", color="black", ms=4)
    axis.lines[0].set_label("recorded")
    for one, colour, label, style in zip(
        oscillations, (RED, BLUE), LABELS, ("--", "-"), strict=False
    ):
        axis.semilogx(
            one.simulated.amplitudes,
            one.simulated.frequencies,
            style,
            color=colour,
            lw=1.4,
            label=label,
        )
    axis.set_xlabel(
        escape_invisible(f"amplitude of a cycle of {first.signal} [{unit}]"), parse_math=False
    )
    axis.set_ylabel("frequency [Hz]")
    axis.grid(alpha=0.3, which="both")
    axis.legend(loc="best", fontsize=8)
    return Picture(figure)
