"""Command replay: run an estimator on a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.common.console import console, progress_spinner, report_written_files
from modewright.cli.common.options import (
    Calibrations,
    Json,
    Out,
    Plot,
    Sets,
    picture_format,
    report_run_end,
    require_run_format,
    values_of,
)
from modewright.runtime.output_files import require_writable, write_files


def replay(
    estimator: Annotated[str, typer.Argument(help="a sampled automaton: name or file")],
    recording: Annotated[Path, typer.Argument(help="a CSV file, may be gzipped")],
    mapping: Annotated[str, typer.Option("--map", "-m", help="map of columns: name or file")],
    variant: Annotated[
        str | None, typer.Option("--variant", help="a variant of the estimator: name or file")
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
    from engine.results.run_file import encode_run
    from modewright.api import simulation as api
    from modewright.render import run as show

    require_run_format(out)
    form = picture_format(plot) if plot else ""
    require_writable(out, plot)
    with progress_spinner(f"replaying {recording.name}"):
        replayed = api.replay(
            estimator, recording, mapping, variant, values_of(sets), calibrations=calibrations or ()
        )
    trajectory, verdict = replayed.result.trajectory, replayed.verdict
    files: dict[Path, bytes] = {}
    if out:
        files |= encode_run(trajectory, out)
    if plot:
        from modewright.render.replay_figure import replay_picture

        title = f"{estimator} on {recording.name}" + (f", variant {variant}" if variant else "")
        files[plot] = replay_picture(replayed, title, form)
    write_files(files)
    if as_json:
        show.print_json(show.replay_json(replayed))
    else:
        show.print_replay(console(), replayed)
        report_written_files(list(files))
    report_run_end(verdict is not None and not verdict.is_equal, trajectory)
