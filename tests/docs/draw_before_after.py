"""Picture of the README: python -m tests.docs.draw_before_after writes docs/before_after.png.

It shows the held-out recording of `modewright demo diagnose`, with the simulation before and after
the diagnosis.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from matplotlib.figure import Figure

from diagnosis.report.model_comparison import compare_models
from engine.results.mode_band import PALETTE
from modewright.api.demo_data import diagnose_demo

TARGET = Path(__file__).resolve().parents[2] / "docs" / "before_after.png"
SIGNAL = "w_s"
"""The wheel speed."""


def main() -> None:
    """Diagnose the demo, draw the worst window of the held-out recording, write TARGET."""
    with tempfile.TemporaryDirectory() as folder:
        found = diagnose_demo("friction", folder, print)
        comparison = compare_models(found.report)[0]
    window, column = comparison.window, comparison.signals.index(SIGNAL)
    misfit = found.report.verdict.fit["held_out"][SIGNAL]
    blue, red = PALETTE[0], PALETTE[1]
    friction = found.report.verdict.effects[0].parameters["T_c"].value
    panels = (
        ("Before: the model with fitted parameters", red, misfit.nrmse_before),
        (
            f"After: with the friction that modewright found, {friction:.2f} N·m",
            blue,
            misfit.nrmse_after,
        ),
    )
    figure = Figure(figsize=(9.0, 3.1), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    shown = window.times >= window.free_from
    times = window.times[shown]
    for axis, (title, colour, nrmse), run in zip(axes, panels, window.runs, strict=True):
        measured, simulated = window.measured[shown, column], run[shown, column]
        axis.plot(times, measured, color="0.65", lw=6, label="recording of the (simulated) machine")
        axis.plot(times, simulated, color=colour, lw=2, label="simulation by the model")
        axis.set_title(f"{title}\nerror {100 * nrmse:.2g} %", fontsize=10)
        axis.set_xlabel("time [s]")
        axis.grid(alpha=0.3)
        axis.legend(loc="upper left", fontsize=9)
    axes[0].set_ylabel("wheel speed [rad/s]")
    figure.savefig(TARGET, dpi=110)


if __name__ == "__main__":
    main()
