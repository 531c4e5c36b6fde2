"""Command diagnose: find the effects that a spec lacks to reproduce recordings."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from modewright.cli.common.console import console, report_written_files
from modewright.cli.common.exit_codes import PROBLEMS
from modewright.cli.common.options import Json, usage_errors
from modewright.runtime.output_files import make_folder

if TYPE_CHECKING:
    from diagnosis.report.diagnosis_report import DiagnosisReport

DURATION_PATTERN = re.compile(r"(\d+(?:\.\d*)?) ?(s|min|h)")
"""The form of a duration."""
SECONDS_PER_UNIT = {"s": 1.0, "min": 60.0, "h": 3600.0}

Train = Annotated[list[Path], typer.Option("--train", help="training recording (repeatable)")]
Map = Annotated[
    str | None, typer.Option("--map", "-m", help="map of columns; by default that of the spec")
]


def folder_of(text: str) -> Path:
    """Return the path of a folder. Raises BadParameter for an empty text."""
    if not text.strip():
        raise typer.BadParameter("name a folder")
    return Path(text)


Out = Annotated[
    Path,
    typer.Option("--out", "-o", help="folder for the results", parser=folder_of, metavar="<path>"),
]
HeldOut = Annotated[
    list[Path] | None,
    typer.Option("--held-out", help="validation recording, used after the verdict (repeatable)"),
]
Effects = Annotated[
    Path | None, typer.Option("--effects", help="folder of effects instead of the library")
]
Thresholds = Annotated[
    str,
    typer.Option(
        "--thresholds",
        help="acceptance thresholds: usual, or a file",
    ),
]
Budget = Annotated[str, typer.Option("--budget", help="time limit: '90 s', '10min'")]
Anyway = Annotated[bool, typer.Option("--anyway", help="also use recordings with errors")]
FailOn = Annotated[
    str | None, typer.Option("--fail-on", help="exit with code 1 for this verdict, e.g. effect")
]
VERDICTS = ("effect", "nothing_missing", "unknown", "ambiguous")


def diagnose(
    spec: Annotated[str, typer.Argument(help="an automaton: name or file")],
    train: Train,
    out: Out,
    held_out: HeldOut = None,
    mapping: Map = None,
    effects: Effects = None,
    thresholds: Thresholds = "usual",
    budget: Budget = "10min",
    anyway: Anyway = False,
    fail_on: FailOn = None,
    as_json: Json = False,
) -> None:
    """Find the effects that a model lacks to reproduce recordings; write the extended model.

    The folder gets report.html, verdict.json, variant.yaml and figures. Exit code 0 if a verdict
    was written.

    \b
    modewright diagnose blind_driveline --train runs/*.csv --held-out c.csv --out found
    modewright diagnose emps --train run.csv --map my_columns --effects my_effects --out found
    modewright diagnose plant.yaml --train a.csv --train b.csv --out found
    modewright diagnose plant.yaml --train night.csv --out found --fail-on effect --json
    """
    from modewright.api.diagnosis import diagnose as run_diagnosis

    if fail_on is not None and fail_on not in VERDICTS:
        raise typer.BadParameter(f"one of {', '.join(VERDICTS)}", param_hint="--fail-on")
    seconds = seconds_of(budget)
    make_folder(out)
    try:
        with usage_errors():
            report = run_diagnosis(
                spec, train, held_out or (), mapping, effects,
                thresholds=thresholds, out=out, budget=seconds, anyway=anyway, tell=report_progress,
            )  # fmt: skip
    except KeyboardInterrupt:
        print(f"intermediate results are in {out}; the same command goes on from there",
              file=sys.stderr)  # fmt: skip
        raise
    _print_report(report, out, as_json)
    if report.verdict.verdict == fail_on:
        raise typer.Exit(PROBLEMS)


def _print_report(report: DiagnosisReport, out: Path, as_json: bool) -> None:
    """Print the report of a diagnosis as JSON or as text."""
    from diagnosis.report.variant_file import missing_effect_notes
    from modewright.render import diagnosis as show_diagnosis, run as show

    for text in missing_effect_notes(report):
        print(f"note: {text}", file=sys.stderr)
    if as_json:
        show.print_json(report.verdict.to_json())
    else:
        show_diagnosis.print_diagnosis(console(), report)
        report_written_files([out / "report.html"])


def report_progress(text: str) -> None:
    """Print a line of progress to stderr unless the console is quiet."""
    if not console().quiet:
        print(text, file=sys.stderr, flush=True)


def seconds_of(text: str) -> float:
    """Return the duration [s] of a text such as `90 s` or `10min`. Raises BadParameter."""
    match = DURATION_PATTERN.fullmatch(text.strip())
    if not match:
        raise typer.BadParameter(f"`{text}` is not a time like `90 s`", param_hint="--budget")
    return float(match[1]) * SECONDS_PER_UNIT[match[2]]
