"""Plan picture: the manoeuvre that would tell candidates apart, and what each would show of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from diagnosis.plan import ExperimentPlan
from engine.results.mode_band import PALETTE
from engine.results.plot import Picture
from language.text.sanitise import escape_invisible


def draw_experiment(
    plan: ExperimentPlan, inputs: Mapping[str, str], signals: Sequence[tuple[str, str]]
) -> Picture:
    """Return the inputs on top, the signals under them; `inputs` and `signals` with their units."""
    best = plan.options[0]
    series = best.manoeuvre.series
    time = np.arange(series.count) * float(series.period)
    moved = [k for k in range(len(inputs)) if float(np.std(series.inputs[:, k])) > 0.0]
    count = 1 + len(signals)
    figure = Figure(figsize=(8.5, 0.8 + 1.7 * count), layout="constrained")
    axes = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    names = list(inputs.items())
    for k in moved:
        axes[0].plot(
            time, series.inputs[:, k], color="black", lw=1.2, label=escape_invisible(names[k][0])
        )
    axes[0].set_ylabel(
        escape_invisible(f"inputs [{names[moved[0]][1] if moved else ''}]"),
        fontsize=9,
        parse_math=False,
    )
    for row, (name, unit) in enumerate(signals):
        axis = axes[row + 1]
        for place, (title, shown) in enumerate(zip(plan.names, best.outputs, strict=True)):
            style = ("-", "--", ":")[place % 3]
            axis.plot(
                time,
                shown[:, row],
                style,
                color=PALETTE[place],
                lw=1.3,
                label=escape_invisible(title),
            )
        axis.set_ylabel(escape_invisible(f"{name} [{unit}]"), fontsize=9, parse_math=False)
    for axis in axes:
        axis.grid(alpha=0.3)
    axes[0].legend(loc="best", fontsize=8)
    axes[1].legend(loc="best", fontsize=8)
    axes[0].set_title(
        escape_invisible(best.manoeuvre.name), loc="left", fontsize=11, parse_math=False
    )
    axes[-1].set_xlabel("time [s]")
    return Picture(figure)
