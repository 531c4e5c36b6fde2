"""Locus picture: how much each place gains where something unknown may act there."""

from __future__ import annotations

import math
from collections.abc import Sequence

from matplotlib.figure import Figure

from diagnosis.locus import Location
from engine.results.mode_band import PALETTE
from engine.results.plot import Picture
from language.text.sanitise import escape_invisible

BLUE, _, _, _, _, _, GREY = PALETTE


def draw_locations(locations: Sequence[Location]) -> Picture:
    """Return a bar for each place, the largest gain [nats] on top.

    An infinite one, where the model does not run at all without it, is drawn beyond the others;
    a place where it does not run in any case is left out.
    """
    known = [location for location in locations if not math.isnan(location.gain)]
    shown = sorted(known, key=lambda location: location.gain)
    figure = Figure(figsize=(7.0, 0.9 + 0.38 * max(1, len(shown))), layout="constrained")
    axis = figure.subplots()
    most = max([location.gain for location in shown if math.isfinite(location.gain)] + [1.0])
    gains = [min(max(location.gain, 0.0), 1.5 * most) for location in shown]
    labels = [f"{max(location.gain, 0.0):.0f}" for location in shown]
    colours = [GREY] * (len(shown) - 1) + [BLUE]
    bars = axis.barh(
        [escape_invisible(location.path) for location in shown], gains, color=colours, height=0.65
    )
    axis.bar_label(bars, labels=labels, padding=3, fontsize=8)
    axis.set_xlim(0.0, 1.12 * max([*gains, 1.0]))
    axis.set_xlabel("what an unknown torque, force or error there would explain [nats]")
    axis.tick_params(axis="y", labelsize=9)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
    return Picture(figure)
