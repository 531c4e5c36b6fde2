"""Demo: simulate a tip-out of an EV driveline, compare it with its C and draw it."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from engine.results.mode_band import ModeBand
from engine.results.plot import Panel, PlotLine, draw_picture
from modewright.api import simulation as api
from modewright.render import run as show
from modewright.runtime.output_files import write_files

SYSTEM, SCENARIO = "ev_driveline", "tip_out"
"""The system of the demo."""

WINDOW = (0.45, 1.15)
"""The time window [s] of the figure, in which the backlash gap is crossed."""


def run_demo(folder: Path, console: Console) -> bool:
    """Simulate SCENARIO of SYSTEM in lock-step, print tables and write `tip_out.png` to a folder.

    Returns whether the run did not stop early and no bit differs between engine and C.
    """
    console.print("Tip-out of an EV driveline with backlash, 30 -> -20 N*m at 0.4785 s")
    trajectory, verdicts = api.lockstep(SYSTEM, SCENARIO)
    torque = [
        PlotLine("plant.T_hs", "plant"),
        PlotLine("est.T_hs", "estimator, 1 kHz"),
        PlotLine("simple.T_hs", "simplified, 100 Hz", dashed=True),
    ]
    gap = [
        PlotLine("plant.theta_b", "plant", 1e3),
        PlotLine("est.theta_b", "estimator, 1 kHz", 1e3, dashed=True),
    ]
    panels = [Panel("half-shaft torque [N*m]", torque), Panel("position in the gap [mrad]", gap)]
    bands = [
        ModeBand("plant", "plant.mode"),
        ModeBand("1 kHz", "est.mode"),
        ModeBand("100 Hz", "simple.mode"),
    ]
    title = "Tip-out: contact is lost, the gap is crossed, the estimators follow"
    path = folder / "tip_out.png"
    write_files({path: draw_picture([trajectory], panels, bands, title, WINDOW).data()})
    console.print(show.events_table(trajectory.events))
    console.print()
    show.print_verdicts(console, verdicts)
    console.print(f"\npicture: {path}", highlight=False, soft_wrap=True)
    return trajectory.stopped is None and all(verdict.is_equal for verdict in verdicts)
