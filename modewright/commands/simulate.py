"""Command simulate: a system through a scenario."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.commands.options import (
    Json,
    Out,
    Plot,
    Scenario,
    Sets,
    System,
    graphic_format,
    stop_where,
    values_of,
)
from modewright.console import announce, console
from modewright.files import require_writable, write_files


def simulate(
    system: System,
    scenario: Scenario,
    sets: Sets = None,
    out: Out = None,
    plot: Plot = None,
    reference: Annotated[
        bool, typer.Option("--reference", help="integrate with scipy, observe with filterpy")
    ] = False,
    as_json: Json = False,
) -> None:
    """Simulate a system: `modewright simulate ev_driveline -s tip_out --plot tip_out.png`."""
    from modewright import api, show

    require_writable(out, plot)
    trajectory = api.simulate(system, scenario, values_of(sets), reference=reference)
    bands = {
        name.removesuffix(".mode"): name for name in trajectory.modes if name in trajectory.signals
    }
    files: dict[Path, bytes] = {}
    if out:
        files[out] = trajectory.csv().encode()
    if plot:
        from engine.plot import all_panels, picture

        title = f"{system}, scenario {scenario}"
        files[plot] = picture(
            trajectory, all_panels(trajectory), bands, title, graphic_format(plot)
        )
    write_files(files)
    if as_json:
        show.print_json(show.trajectory_json(trajectory))
    else:
        console.print(show.events_table(trajectory.events))
    stop_where(trajectory.stopped is not None, trajectory)
    if not as_json:
        announce(list(files))
