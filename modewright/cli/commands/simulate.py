"""Command simulate: simulate a system in a scenario."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from modewright.cli.common.console import console, progress_spinner, report_written_files
from modewright.cli.common.options import (
    Calibrations,
    Json,
    Out,
    Plot,
    Scenario,
    Sets,
    System,
    picture_format,
    report_run_end,
    require_run_format,
    usage_errors,
    values_of,
)
from modewright.runtime.output_files import require_writable, write_files

if TYPE_CHECKING:
    from engine.results.trajectory import Trajectory


def simulate(
    system: System,
    scenario: Scenario,
    sets: Sets = None,
    calibrations: Calibrations = None,
    out: Out = None,
    plot: Plot = None,
    reference: Annotated[
        bool, typer.Option("--reference", help="independent reference: scipy and filterpy")
    ] = False,
    method: Annotated[
        str | None,
        typer.Option("--method", help="RK4 (default), or DOP853, Radau, LSODA of scipy"),
    ] = None,
    compiled: Annotated[
        bool | None,
        typer.Option(
            "--compiled/--interpreted", help="use C or the interpreter; results are equal"
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Simulate a system, or an automaton alone, in a scenario.

    \b
    modewright simulate ev_driveline -s tip_out --plot tip_out.png
    modewright simulate ev_driveline -s tip_out --set 'k_hs=6000 N*m/rad' --out run.csv
    """
    from engine.results.run_file import encode_run
    from modewright.api import simulation as api

    _require_one_integration(reference, method, compiled)
    require_run_format(out)
    form = picture_format(plot) if plot else ""
    require_writable(out, plot)
    with progress_spinner(f"simulating {system}, {scenario}"), usage_errors():
        trajectory = api.simulate(
            system,
            scenario,
            values_of(sets),
            reference=reference,
            method=method or "RK4",
            calibrations=calibrations or (),
            compiled=compiled,
        )
    files = encode_run(trajectory, out) if out else {}
    if plot:
        files[plot] = _draw_plot(trajectory, f"{system}, scenario {scenario}", form)
    write_files(files)
    _report_run(trajectory, list(files), as_json)


def _require_one_integration(reference: bool, method: str | None, compiled: bool | None) -> None:
    """Raise BadParameter for options of which one would have no effect.

    C and interpreter integrate with RK4 only, and the reference with methods of scipy only.
    """
    if reference and method == "RK4":
        label = "the reference integrates with scipy: leave out --method RK4 or --reference"
        raise typer.BadParameter(label, param_hint="--method")
    if compiled is not None and (reference or method not in (None, "RK4")):
        option = "--compiled" if compiled else "--interpreted"
        other = "--reference" if reference else f"--method {method}"
        label = f"scipy integrates with {other}: leave out {option} or {other}"
        raise typer.BadParameter(label, param_hint=option)


def _report_run(trajectory: Trajectory, files: list[Path], as_json: bool) -> None:
    """Print a run as JSON or as a table of events; exit with code 1 if it stopped."""
    from modewright.render import run as show

    if as_json:
        show.print_json(show.trajectory_json(trajectory))
    else:
        console().print(show.events_table(trajectory.events))
    report_run_end(trajectory.stopped is not None, trajectory)
    if not as_json:
        report_written_files(files)


def _draw_plot(trajectory: Trajectory, title: str, form: str) -> bytes:
    """Return the figure of a run in a format."""
    from engine.results.plot import draw_overview

    return draw_overview([trajectory], title=title).data(form)
