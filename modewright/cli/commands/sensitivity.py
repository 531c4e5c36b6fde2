"""Command sensitivity: print the sensitivity indices of a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.common.console import console, report_written_files
from modewright.cli.common.options import Json
from modewright.runtime.output_files import require_writable, write_files


def sensitivity(
    results: Annotated[Path, typer.Argument(help="the folder of a study's results")],
    table: Annotated[
        Path | None, typer.Option("--csv", help="write the indices as CSV, numbers in SI")
    ] = None,
    as_json: Json = False,
) -> None:
    """Print the influence of each random variable of a study on its measures, with intervals.

    The study needs a design: `sampling: {saltelli: 256, seed: 1}` for Sobol indices (fractions of
    the variance), or with fewer runs `sampling: {morris: 50, seed: 1}` for elementary effects.

    \b
    modewright sweep my_study.yaml --out results
    modewright sensitivity results
    modewright sensitivity results --csv indices.csv --json
    """
    from modewright.api import studies
    from modewright.render import sensitivity as show_sensitivity
    from modewright.render.run import print_json

    require_writable(table)
    found = studies.sensitivity(results)
    if table:
        write_files({table: found.csv().encode()})
    if as_json:
        print_json(show_sensitivity.sensitivity_json(found))
    else:
        show_sensitivity.print_sensitivity(console(), found)
        report_written_files([table] if table else [])
