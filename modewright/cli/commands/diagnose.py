"""Command diagnose: which physics a spec lacks to show what was recorded."""

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
SECONDS_PER_UNIT = {"s": 1.0, "min": 60.0, "h": 3600.0}

Train = Annotated[
    list[Path], typer.Option("--train", help="a recording to learn from (repeatable)")
]
Map = Annotated[
    str | None, typer.Option("--map", "-m", help="a map of columns, if not that of the spec")
]


def folder_of(text: str) -> Path:
    """Return the folder that a text names: none is named by an empty one."""
    if not text.strip():
        raise typer.BadParameter("name a folder")
    return Path(text)


Out = Annotated[
    Path,
    typer.Option(
        "--out", "-o", help="the folder of the results", parser=folder_of, metavar="<path>"
    ),
]
HeldOut = Annotated[
    list[Path] | None,
    typer.Option("--held-out", help="a recording opened after the verdict (repeatable)"),
]
Effects = Annotated[
    Path | None, typer.Option("--effects", help="a folder of effects in place of those shipped")
]
Thresholds = Annotated[
    str,
    typer.Option(
        "--thresholds",
        help="what effects must gain: kept (by an earlier bootstrap), bootstrap, usual, a file",
    ),
]
Budget = Annotated[
    str, typer.Option("--budget", help="the longest time it may take: '90 s', '10min'")
]
Anyway = Annotated[bool, typer.Option("--anyway", help="conclude from recordings with errors too")]
FailOn = Annotated[
    str | None, typer.Option("--fail-on", help="a verdict that gives exit code 1: effect")
]
VERDICTS = ("effect", "nothing_missing", "unknown", "ambiguous")


def diagnose(
    spec: Annotated[str, typer.Argument(help="an automaton: name or file")],
    train: Train,
    out: Out,
    held_out: HeldOut = None,
    mapping: Map = None,
    effects: Effects = None,
    thresholds: Thresholds = "kept",
    budget: Budget = "10min",
    anyway: Anyway = False,
    fail_on: FailOn = None,
    as_json: Json = False,
) -> None:
    """Say which physics a model lacks to show what was recorded, and write a model that has it.

    Into the folder go report.html, verdict.json, variant.yaml and figures. Exit code 0 whenever
    a verdict was written.

    \b
    modewright diagnose blind_driveline --train runs/*.csv --held-out c.csv --out found
    modewright diagnose emps --train run.csv --map my_columns --effects my_effects --out found
    modewright diagnose plant.yaml --train a.csv --train b.csv --thresholds bootstrap --out found
    modewright diagnose plant.yaml --train night.csv --out found --fail-on effect --json
    """
    from modewright.api.diagnosis import diagnose as diagnosed

    if fail_on is not None and fail_on not in VERDICTS:
        raise typer.BadParameter(f"one of {', '.join(VERDICTS)}", param_hint="--fail-on")
    seconds = seconds_of(budget)
    make_folder(out)
    try:
        with usage_errors():
            found = diagnosed(
                spec, train, held_out or (), mapping, effects,
                thresholds=thresholds, out=out, budget=seconds, anyway=anyway, tell=report_progress,
            )  # fmt: skip
    except KeyboardInterrupt:
        print(f"what was found is kept in {out}; the same command goes on from there",
              file=sys.stderr)  # fmt: skip
        raise
    _report_dossier(found, out, as_json)
    if found.verdict.verdict == fail_on:
        raise typer.Exit(PROBLEMS)


def _report_dossier(found: DiagnosisReport, out: Path, as_json: bool) -> None:
    from diagnosis.report.diagnosis_report import verdict_to_json
    from diagnosis.report.variant_file import missing_effect_notes
    from modewright.render import diagnosis as show_diagnosis, run as show

    for text in missing_effect_notes(found):
        print(f"note: {text}", file=sys.stderr)
    if as_json:
        show.print_json(verdict_to_json(found.verdict))
    else:
        show_diagnosis.print_dossier(console(), found)
        report_written_files([out / "report.html"])


def report_progress(text: str) -> None:
    """Tell on stderr what a stage has found."""
    if not console().quiet:
        print(text, file=sys.stderr, flush=True)


def seconds_of(text: str) -> float:
    """Return a time [s] written as `90 s` or `10min`."""
    match = DURATION_PATTERN.fullmatch(text.strip())
    if not match:
        raise typer.BadParameter(f"`{text}` is not a time like `90 s`", param_hint="--budget")
    return float(match[1]) * SECONDS_PER_UNIT[match[2]]
