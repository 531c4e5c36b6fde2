"""Command check: report all problems of specs."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from modewright.cli.common.console import console, report_written_files
from modewright.cli.common.exit_codes import MAX_SHOWN, PROBLEMS
from modewright.cli.common.options import Json
from modewright.render.pluralisation import pluralise
from modewright.runtime.json_format import format_entry
from modewright.runtime.output_files import require_writable, write_files

if TYPE_CHECKING:
    from language.text.diagnostic import Problem
    from modewright.api.spec_check import CheckResult


def check(
    specs: Annotated[list[str] | None, typer.Argument(help="specs: names or files")] = None,
    every: Annotated[bool, typer.Option("--all", help="check all specs below spec/")] = False,
    as_json: Json = False,
    as_annotations: Annotated[
        bool, typer.Option("--github", help="print problems as GitHub Actions annotations")
    ] = False,
    sarif: Annotated[Path | None, typer.Option(help="write the problems as SARIF 2.1.0")] = None,
    watch: Annotated[
        bool, typer.Option("--watch", help="check again when a spec changes, until Ctrl-C")
    ] = False,
) -> None:
    """Report all problems of specs, with places, codes (docs/problems.md) and help.

    Exit code 1 if there are errors; warnings do not change it.

    \b
    modewright check estimator spec/ev_driveline/plant.yaml
    modewright check --all --json
    modewright check --all --github --sarif problems.sarif
    modewright check --all --watch
    """
    from modewright.api import spec_check as checking
    from modewright.cli.common.watch import spec_folders, watch_changes

    if as_json and as_annotations:
        raise typer.BadParameter("leave out one of them", param_hint="--json, --github")
    require_writable(sarif)
    if not (specs or every):
        raise typer.BadParameter("name a spec, or use --all", param_hint="SPECS")

    def names() -> list[str]:
        return list(specs or []) + [str(path) for path in checking.spec_files(Path()) if every]

    is_fine = _check_specs(names(), len(specs or []), as_json, as_annotations, sarif)
    for changed in watch_changes(spec_folders(specs or [])) if watch else ():
        console().print(f"\n{', '.join(map(str, changed))} changed", highlight=False)
        _check_specs(names(), len(specs or []), as_json, as_annotations, sarif)
    if not is_fine:
        raise typer.Exit(PROBLEMS)


def _check_specs(
    names: list[str], named: int, as_json: bool, as_annotations: bool, sarif: Path | None
) -> bool:
    """Check specs, report their problems and return whether there are no errors.

    No spec at all is an error. Without errors the step limits of the first `named` specs are
    printed, too.
    """
    from modewright.api import spec_check as checking

    found = [checking.check_spec(name) for name in names]
    if not names:
        found = [checking.CheckResult(tuple(checking.no_spec_error(Path("spec")).problems))]
    problems = checking.merge_problems(found)
    if sarif:
        _write_sarif(sarif, problems, as_json)
    _report_problems(problems, len(names), as_json, as_annotations)
    is_fine = all(problem.severity != "error" for problem in problems)
    if is_fine and not (as_json or as_annotations):
        _report_limits(found[:named])
    return is_fine


def _report_problems(
    problems: Sequence[Problem], specs: int, as_json: bool, as_annotations: bool = False
) -> None:
    """Print problems as JSON, as GitHub annotations, or as text with the number of specs."""
    from language.text.diagnostic import render_all
    from modewright.api.spec_check import problem_json
    from modewright.render.github_annotations import annotation_lines

    if as_json:
        entries = [problem_json(problem) for problem in problems]
        report = {**format_entry("problems"), "problems": entries}
        print(json.dumps(report, indent=2, allow_nan=False))
        return
    if as_annotations:
        print(annotation_lines(problems), end="")
    elif problems:
        print(render_all(problems[:MAX_SHOWN]), file=sys.stderr)
        if len(problems) > MAX_SHOWN:
            print(f"\n... and {len(problems) - MAX_SHOWN} more: --json", file=sys.stderr)
    errors = sum(problem.severity == "error" for problem in problems)
    counts = [f"{pluralise(specs, 'spec')} checked", pluralise(errors, "problem")]
    if errors < len(problems):
        counts.append(pluralise(len(problems) - errors, "warning"))
    console().print(", ".join(counts))


def _report_limits(found: Sequence[CheckResult]) -> None:
    """Print the step limits of checked automata."""
    for each in found:
        for line in each.limits:
            console().print(line, soft_wrap=True, highlight=False, markup=False)


def _write_sarif(path: Path, problems: Sequence[Problem], silent: bool) -> None:
    """Write problems as SARIF; report the file unless silent."""
    from modewright.render.sarif import to_sarif

    text = json.dumps(to_sarif(problems), indent=2, allow_nan=False)
    write_files({path: f"{text}\n".encode()})
    if not silent:
        report_written_files([path])
