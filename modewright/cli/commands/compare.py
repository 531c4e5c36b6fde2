"""Command compare: compare two runs signal by signal."""

from __future__ import annotations

from typing import Annotated

import typer

from modewright.cli.commands.plot import RunArgument
from modewright.cli.common.console import console, progress_spinner, report_written_files
from modewright.cli.common.exit_codes import PROBLEMS
from modewright.cli.common.options import (
    From,
    Json,
    Plot,
    Signals,
    To,
    picture_format,
    span_of,
    usage_errors,
)
from modewright.runtime.output_files import require_writable, write_files


def compare(
    a: Annotated[str, RunArgument],
    b: Annotated[str, RunArgument],
    relative: Annotated[
        float, typer.Option(min=0.0, help="tolerance of signals, relative to their peak in A")
    ] = 0.0,
    tolerance: Annotated[
        list[str] | None,
        typer.Option(help="tolerance of signals in their unit: '*.T_hs=0.5' (repeatable)"),
    ] = None,
    slack: Annotated[
        float, typer.Option(min=0.0, help="time for which modes may differ [s]")
    ] = 0.0,
    offset: Annotated[float, typer.Option(help="time that is added to the times of B [s]")] = 0.0,
    align: Annotated[
        bool, typer.Option("--align", help="find that time by correlation of the runs")
    ] = False,
    signals: Signals = None,
    start: From = None,
    end: To = None,
    plot: Plot = None,
    as_json: Json = False,
) -> None:
    """Compare two runs: signals, modes, transitions.

    A run is a .csv or .parquet file, or system:scenario. Exit code 0: the runs agree within
    tolerance; 1: they do not, or a signal or a time span exists in one run only.

    \b
    modewright compare run.csv ev_driveline:tip_out
    modewright compare run.csv other.csv --align --relative 0.01
    modewright compare a.csv b.parquet --relative 1e-6 --tolerance '*.T_hs=0.5' --plot diff.png
    """
    from modewright.api import runs
    from modewright.render import run as show

    form = picture_format(plot) if plot else "png"
    require_writable(plot)
    with usage_errors(), progress_spinner(f"comparing {a} and {b}"):
        first, second = runs.read(a), runs.read(b)
        found = runs.compare(
            first, second, relative=relative, tolerances=_parse_tolerances(tolerance),
            slack=slack, signals=signals or None, span=span_of(start, end), offset=offset,
            align=align,
        )  # fmt: skip
    if plot:
        from engine.results.comparison_plot import draw_difference
        from engine.results.time_alignment import shift_times

        names = (runs.run_label(a, "A"), runs.run_label(b, "B"))
        shifted = shift_times(second, found.shift.offset)
        write_files({plot: draw_difference(first, shifted, found, names).data(form)})
    if as_json:
        show.print_json(show.difference_json(found))
    else:
        show.print_difference(console(), found)
        report_written_files([plot] if plot else [])
    if not found.is_within:
        raise typer.Exit(PROBLEMS)


def _parse_tolerances(texts: list[str] | None) -> dict[str, float]:
    """Return tolerances by signal pattern from texts `signal=number`. Raises BadParameter."""
    found = {}
    for text in texts or []:
        name, _, value = text.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            label = f"`{text}` is not `signal=number`, the number in the signal's unit"
            raise typer.BadParameter(label, param_hint="--tolerance") from None
    return found
