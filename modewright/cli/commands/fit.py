"""Command fit: parameters of a spec from recordings."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.commands.diagnose import Map, Train, report_progress
from modewright.cli.common.console import console, report_written_files
from modewright.cli.common.exit_codes import PROBLEMS
from modewright.cli.common.options import Json, calibration_title, usage_errors
from modewright.runtime.output_files import write_files

Anyway = Annotated[bool, typer.Option("--anyway", help="fit to recordings with errors too")]


def fit(
    spec: Annotated[str, typer.Argument(help="an automaton: name or file")],
    train: Train,
    parameters: Annotated[
        str | None, typer.Option("--parameters", help="those that may move: 'k_hs,c_hs'")
    ] = None,
    mapping: Map = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="write a calibration: .yaml")
    ] = None,
    name: Annotated[
        str | None, typer.Option("--name", help="of the calibration; that of its file if absent")
    ] = None,
    date: Annotated[str, typer.Option("--date", help="of the recordings: '2026-11-21'")] = "",
    anyway: Anyway = False,
    as_json: Json = False,
) -> None:
    """Fit parameters within their ranges to recordings; tell what these cannot determine.

    \b
    modewright fit blind_driveline --train runs/*.csv --parameters k,c --out rig_7.yaml
    modewright fit emps --train run.csv --map my_columns --json
    """
    from modewright.api.diagnosis import UnusableRecordings, fit as fitted
    from modewright.render import diagnosis as show_diagnosis, run as show

    title = calibration_title(out, name, date)
    chosen = names_of(parameters) if parameters is not None else None
    try:
        with usage_errors():
            found = fitted(spec, train, chosen, mapping, anyway=anyway, tell=report_progress)
    except UnusableRecordings as error:
        print(f"error: {error} (`--anyway` fits all the same)", file=sys.stderr)
        raise typer.Exit(PROBLEMS) from None
    if out:
        write_files({out: found.calibration(title, date).encode()})
    if as_json:
        show.print_json(show_diagnosis.fit_json(found))
    else:
        show_diagnosis.print_fit(console(), found)
        report_written_files([out] if out else [])


def names_of(text: str) -> list[str]:
    """Return the names of --parameters."""
    names = [part.strip() for part in text.split(",")]
    if not all(names):
        raise typer.BadParameter(f"`{text}` has an empty name", param_hint="--parameters")
    twice = [name for k, name in enumerate(names) if name in names[:k]]
    if twice:
        raise typer.BadParameter(f"`{twice[0]}` is named twice", param_hint="--parameters")
    return names
