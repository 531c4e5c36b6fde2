"""Command fit: fit parameters of a spec to recordings."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.commands.diagnose import Map, Train, report_progress
from modewright.cli.common.console import console, report_written_files
from modewright.cli.common.exit_codes import PROBLEMS
from modewright.cli.common.options import Json, calibration_name, usage_errors
from modewright.runtime.output_files import write_files

Anyway = Annotated[bool, typer.Option("--anyway", help="also use recordings with errors")]


def fit(
    spec: Annotated[str, typer.Argument(help="an automaton: name or file")],
    train: Train,
    parameters: Annotated[
        str | None,
        typer.Option("--parameters", help="parameters to fit: 'k,c'; by default all with a range"),
    ] = None,
    mapping: Map = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="write a calibration: .yaml")
    ] = None,
    name: Annotated[
        str | None,
        typer.Option("--name", help="name of the calibration; by default that of its file"),
    ] = None,
    date: Annotated[str, typer.Option("--date", help="date of the recordings: '2026-11-21'")] = "",
    anyway: Anyway = False,
    as_json: Json = False,
) -> None:
    """Fit parameters within their ranges to recordings; report those that are not identifiable.

    \b
    modewright fit blind_driveline --train runs/*.csv --parameters k,c --out rig_7.yaml
    modewright fit emps --train run.csv --map my_columns --json
    """
    from modewright.api.diagnosis import UnusableRecordings, fit as fit_parameters
    from modewright.render import diagnosis as show_diagnosis, run as show

    for option, is_used in (("--name", name is not None), ("--date", date)):
        if is_used and out is None:
            raise typer.BadParameter("goes with --out, the calibration", param_hint=option)
    title = calibration_name(out, name, date)
    chosen = names_of(parameters) if parameters is not None else None
    try:
        with usage_errors():
            result = fit_parameters(
                spec, train, chosen, mapping, anyway=anyway, tell=report_progress
            )
    except UnusableRecordings as error:
        hint = " (`--anyway` uses them nevertheless)" if error.can_be_used_anyway else ""
        print(f"error: {error}{hint}", file=sys.stderr)
        raise typer.Exit(PROBLEMS) from None
    if out:
        write_files({out: result.calibration(title, date).encode()})
    if as_json:
        show.print_json(show_diagnosis.fit_json(result))
    else:
        show_diagnosis.print_fit(console(), result)
        report_written_files([out] if out else [])


def names_of(text: str) -> list[str]:
    """Return the comma-separated names of --parameters.

    Raises BadParameter for empty and double names.
    """
    names = [part.strip() for part in text.split(",")]
    if not all(names):
        raise typer.BadParameter(f"`{text}` has an empty name", param_hint="--parameters")
    twice = [name for k, name in enumerate(names) if name in names[:k]]
    if twice:
        raise typer.BadParameter(f"`{twice[0]}` is named twice", param_hint="--parameters")
    return names
