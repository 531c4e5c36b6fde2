"""Command lockstep: engine and compiled C compared bit by bit."""

from __future__ import annotations

from modewright.commands.options import Json, Scenario, Sets, System, stop_where, values_of
from modewright.console import console, working


def lockstep(system: System, scenario: Scenario, sets: Sets = None, as_json: Json = False) -> None:
    """Compare engine and compiled C, tick by tick and bit by bit.

    \b
    modewright lockstep ev_driveline -s tip_out
    """
    from modewright import api, show

    with working(f"simulating {system}, {scenario}, and running its C"):
        trajectory, verdicts = api.lockstep(system, scenario, values_of(sets))
    if as_json:
        found = {"lockstep": [show.verdict_json(verdict) for verdict in verdicts]}
        show.print_json({**show.trajectory_json(trajectory), **found})
    else:
        show.print_verdicts(console(), verdicts)
    stop_where(trajectory.stopped is not None or not all(v.is_equal for v in verdicts), trajectory)
