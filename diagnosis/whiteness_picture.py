"""Whiteness picture: how long what is missed hangs together, signal by signal."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from diagnosis.whiteness import WhitenessTest
from engine.results.mode_band import PALETTE
from engine.results.plot import Picture
from language.text.sanitise import escape_invisible

BLUE, RED, *_ = PALETTE


def draw_whiteness(
    before: Sequence[WhitenessTest], after: Sequence[WhitenessTest], is_base_only: bool
) -> Picture:
    """Return the correlations by lag of both models, with the band of white noise.

    `is_base_only`: nothing was laid over the base, so that one model is all there is.
    """
    figure = Figure(figsize=(8.5, 2.7), layout="constrained")
    axes = figure.subplots(1, len(before), squeeze=False, sharey=True)[0]
    for axis, old, new in zip(axes, before, after, strict=True):
        lags = 1000.0 * old.lags
        axis.axhspan(-old.band, old.band, color="#999999", alpha=0.35, lw=0, label="white noise")
        axis.axhline(0.0, color="black", lw=0.6)
        first = "recalibrated" if is_base_only else "without"
        axis.plot(lags, old.correlations, "s--", color=RED, ms=3.5, lw=1.0, label=first)
        if not is_base_only:
            axis.plot(lags, new.correlations, "o-", color=BLUE, ms=3.0, lw=1.2, label="with")
        axis.set_title(escape_invisible(old.signal), loc="left", fontsize=10, parse_math=False)
        axis.set_xlabel("lag [ms]", fontsize=9)
        axis.grid(alpha=0.3)
        axis.tick_params(labelsize=8)
    axes[0].set_ylabel("correlation", fontsize=9)
    axes[0].legend(loc="upper right", fontsize=8)
    return Picture(figure)
