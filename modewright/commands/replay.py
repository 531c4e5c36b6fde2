"""Command replay: an estimator on a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.commands.options import (
    Calibrations,
    Json,
    Out,
    Plot,
    Sets,
    graphic_format,
    require_run,
    stop_where,
    values_of,
)
from modewright.console import announce, console, working
from modewright.files import require_writable, write_files


def replay(
    estimator: Annotated[str, typer.Argument(help="a sampled automaton: name or file")],
    recording: Annotated[Path, typer.Argument(help="a CSV file, may be gzipped")],
    mapping: Annotated[str, typer.Option("--map", "-m", help="a map of columns: name or file")],
    variant: Annotated[
        str | None, typer.Option("--variant", help="a variant laid over the estimator")
    ] = None,
    sets: Sets = None,
    calibrations: Calibrations = None,
    out: Out = None,
    plot: Plot = None,
    as_json: Json = False,
) -> None:
    """Run an estimator on a recording, engine and C in lock-step.

    \b
    modewright replay estimator drive.csv --map leaf_can --variant leaf --plot drive.png
    """
    from engine.run_file import run_files
    from modewright import api, show

    require_run(out)
    require_writable(out, plot)
    with working(f"replaying {recording.name}"):
        replayed = api.replay(
            estimator, recording, mapping, variant, values_of(sets), calibrations=calibrations or ()
        )
    trajectory, verdict = replayed.result.trajectory, replayed.verdict
    files: dict[Path, bytes] = {}
    if out:
        files |= run_files(trajectory, out)
    if plot:
        from modewright.replay_picture import replay_picture

        title = f"{estimator} on {recording.name}" + (f", variant {variant}" if variant else "")
        files[plot] = replay_picture(replayed, title, graphic_format(plot))
    write_files(files)
    if as_json:
        show.print_json(show.replay_json(replayed))
    else:
        show.print_replay(console(), replayed)
        announce(list(files))
    stop_where(verdict is not None and not verdict.is_equal, trajectory)
