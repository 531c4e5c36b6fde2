"""Command check: report all problems of specs."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from modewright.cli.common.console import console, report_written_files
from modewright.cli.common.exit_codes import MAX_SHOWN, PROBLEMS
from modewright.cli.common.options import Json
from modewright.render.pluralisation import pluralise
from modewright.runtime.json_format import format_entry
from modewright.runtime.output_files import require_writable, write_files

if TYPE_CHECKING:
    from language.text.diagnostic import Problem
    from modewright.api.ir_check import IrCheck
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
    ir: Annotated[
        bool, typer.Option("--ir", help="check the Program after each pass, too")
    ] = False,
) -> None:
    """Report all problems of specs, with places, codes (docs/problems.md) and help.

    Exit code 1 if there are errors; warnings do not change it. The option --ir checks the
    intermediate representation of each automaton after lowering and after each pass; a violation
    is a fault of this program and not of the spec.

    \b
    modewright check estimator spec/ev_driveline/plant.yaml
    modewright check --all --json
    modewright check --all --github --sarif problems.sarif
    modewright check --all --watch
    modewright check estimator --ir
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

    def check_all() -> bool:
        return _check_specs(names(), len(specs or []), as_json, as_annotations, sarif, ir)

    is_fine = check_all()
    for changed in watch_changes(spec_folders(specs or [])) if watch else ():
        console().print(f"\n{', '.join(map(str, changed))} changed", highlight=False)
        check_all()
    if not is_fine:
        raise typer.Exit(PROBLEMS)


def _check_specs(
    names: list[str],
    named: int,
    as_json: bool,
    as_annotations: bool,
    sarif: Path | None,
    with_ir: bool,
) -> bool:
    """Check specs, report their problems and return whether there are no errors.

    No spec at all is an error. Without errors the step limits of the first `named` specs are
    printed, too. With `with_ir` the Programs of all specs are checked and reported.
    """
    from modewright.api import spec_check as checking

    found = [checking.check_spec(name) for name in names]
    if not names:
        found = [checking.CheckResult(tuple(checking.no_spec_error(Path("spec")).problems))]
    problems = checking.merge_problems(found)
    if sarif:
        _write_sarif(sarif, problems, as_json)
    checks = _check_programs(names) if with_ir else None
    _report_problems(problems, len(names), as_json, as_annotations, checks)
    is_fine = all(problem.severity != "error" for problem in problems)
    if is_fine and not (as_json or as_annotations):
        _report_limits(found[:named])
    if checks is None:
        return is_fine
    if not as_json:
        _report_programs(checks)
    return is_fine and all(each.is_valid for each in checks)


def _check_programs(names: Sequence[str]) -> list[IrCheck]:
    """Return the checks of the Programs of specs, each automaton once.

    Specs with errors have none.
    """
    from language.text.diagnostic import SpecError
    from modewright.api.ir_check import check_ir

    found: dict[str, IrCheck] = {}
    for name in names:
        with suppress(SpecError):  # its problems are reported
            found.update((each.automaton, each) for each in check_ir(name))
    return list(found.values())


def _report_programs(checks: Sequence[IrCheck]) -> None:
    """Print the violations of Programs, and how many Programs were checked."""
    for each in checks:
        for name, violations in each.violations.items():
            for violation in violations:
                print(f"{each.automaton}, after `{name}`: {violation}", file=sys.stderr)
    programs = sum(len(each.violations) for each in checks)
    count = sum(len(found) for each in checks for found in each.violations.values())
    counts = f"{pluralise(programs, 'Program')} checked, {pluralise(count, 'violation')}"
    console().print(counts)


def _report_problems(
    problems: Sequence[Problem],
    specs: int,
    as_json: bool,
    as_annotations: bool,
    checks: Sequence[IrCheck] | None,
) -> None:
    """Print problems as JSON, as GitHub annotations, or as text with the number of specs.

    The JSON object has the key `ir` with one item for each of the `checks` of Programs, if there
    are any.
    """
    from language.text.diagnostic import render_all
    from modewright.api.spec_check import problem_json
    from modewright.render.github_annotations import annotation_lines

    if as_json:
        entries = [problem_json(problem) for problem in problems]
        report: dict[str, Any] = {**format_entry("problems"), "problems": entries}
        if checks is not None:
            from modewright.api.ir_check import ir_check_json

            report["ir"] = [ir_check_json(each) for each in checks]
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
