"""Command compare: two runs, signal by signal."""

from __future__ import annotations

from typing import Annotated

import typer

from modewright.commands.options import (
    From,
    Json,
    Plot,
    Signals,
    To,
    graphic_format,
    span_of,
    usage_errors,
)
from modewright.commands.plot import RunArgument
from modewright.console import announce, console, working
from modewright.exits import PROBLEMS
from modewright.files import require_writable, write_files


def compare(
    a: Annotated[str, RunArgument],
    b: Annotated[str, RunArgument],
    relative: Annotated[
        float, typer.Option(min=0.0, help="a signal may differ by this share of its peak in A")
    ] = 0.0,
    tolerance: Annotated[
        list[str] | None,
        typer.Option(help="a signal may differ by this, in its unit: '*.T_hs=0.5' (repeatable)"),
    ] = None,
    slack: Annotated[float, typer.Option(min=0.0, help="modes may disagree for so long [s]")] = 0.0,
    signals: Signals = None,
    start: From = None,
    end: To = None,
    plot: Plot = None,
    as_json: Json = False,
) -> None:
    """Compare two runs: signals, modes, transitions.

    Exit code 0: within tolerance; 1: not, or a signal or a part of the time is in one run only.

    \b
    modewright compare run.csv ev_driveline:tip_out
    modewright compare a.csv b.parquet --relative 1e-6 --tolerance '*.T_hs=0.5' --plot apart.png
    """
    from modewright import runs, show

    form = graphic_format(plot) if plot else "png"
    require_writable(plot)
    with usage_errors(), working(f"comparing {a} and {b}"):
        first, second = runs.read(a), runs.read(b)
        found = runs.compare(
            first, second, relative=relative, tolerances=_tolerances(tolerance),
            slack=slack, signals=signals or (), span=span_of(start, end),
        )  # fmt: skip
    if plot:
        from engine.difference_picture import difference_picture

        names = (runs.label(a, "A"), runs.label(b, "B"))
        write_files({plot: difference_picture(first, second, found, names).data(form)})
    if as_json:
        show.print_json(show.difference_json(found))
    else:
        show.print_difference(console(), found)
        announce([plot] if plot else [])
    if not found.is_within:
        raise typer.Exit(PROBLEMS)


def _tolerances(texts: list[str] | None) -> dict[str, float]:
    found = {}
    for text in texts or []:
        name, _, value = text.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            label = f"`{text}` is not `signal=number`, the number in the signal's unit"
            raise typer.BadParameter(label, param_hint="--tolerance") from None
    return found
