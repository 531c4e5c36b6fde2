"""Command plot: draw one or two runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.common.console import report_written_files
from modewright.cli.common.options import From, Signals, To, picture_format, span_of, usage_errors
from modewright.runtime.output_files import require_writable, write_files

RunArgument = typer.Argument(help="a run: .csv, .parquet, or system:scenario to simulate")


def plot(
    a: Annotated[str, RunArgument],
    b: Annotated[str | None, RunArgument] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="the figure: .png, .svg or .pdf")] = Path(
        "plot.png"
    ),
    signals: Signals = None,
    start: From = None,
    end: To = None,
) -> None:
    """Draw one run, or two runs in the same axes.

    \b
    modewright plot run.csv --out run.png
    modewright plot run.csv ev_driveline:tip_out --signals 'plant.*' --from 0.4 --to 1.2
    """
    from modewright.api import runs

    form = picture_format(out)
    require_writable(out)
    with usage_errors():
        drawn = runs.plot(a, b, signals=signals or None, span=span_of(start, end))
    write_files({out: drawn.data(form)})
    report_written_files([out])
