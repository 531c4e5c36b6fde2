"""Command test: run the tests of specs on the engine and in C."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from modewright.cli.common.console import console, progress_spinner, report_written_files
from modewright.cli.common.exit_codes import PROBLEMS
from modewright.cli.common.options import Json
from modewright.runtime.json_format import format_entry
from modewright.runtime.output_files import make_folder, require_writable, write_files

if TYPE_CHECKING:
    from expectation.coverage_measurement import Coverage
    from modewright.api.spec_tests import TestRun


def test(
    tests: Annotated[
        list[str] | None,
        typer.Argument(help="tests: names or files; by default all of the project"),
    ] = None,
    junit: Annotated[
        Path | None, typer.Option("--junit", help="write the results as JUnit XML")
    ] = None,
    interpreted: Annotated[
        bool, typer.Option("--interpreted", help="use the engine only, without a compiler")
    ] = False,
    coverage: Annotated[
        bool,
        typer.Option("--coverage", help="report the coverage of modes, transitions, conditions"),
    ] = False,
    graphs: Annotated[
        Path | None, typer.Option("--graphs", help="folder for mode diagrams coloured by coverage")
    ] = None,
    as_json: Json = False,
) -> None:
    """Run tests of specs on the engine and in C; both must give the same results.

    Exit code 1 if a test fails.

    \b
    modewright test
    modewright test tip_out_is_detected --junit build/tests.xml
    modewright test --coverage --graphs build
    """
    from expectation.coverage_measurement import measure_coverage, merge_coverages
    from modewright.api.spec_tests import run_tests
    from modewright.render.spec_tests import spec_test_lines

    require_writable(junit)
    runs: list[TestRun] = []
    parts: list[Coverage] = []
    with progress_spinner("running tests"):
        for run in run_tests(tests or None, compiled=not interpreted):
            runs.append(run)
            parts += measure_coverage(run.test) if coverage or graphs else ()
            _print_lines(() if as_json else spec_test_lines(run))
    sums = merge_coverages(parts)
    pictures = _write_results(runs, sums, junit, graphs)
    if as_json:
        _print_json(runs, sums)
    else:
        _report_end(runs, sums)
        report_written_files(pictures)
    if not all(run.passed for run in runs):
        raise typer.Exit(PROBLEMS)


def _write_results(
    runs: Sequence[TestRun], sums: Sequence[Coverage], junit: Path | None, graphs: Path | None
) -> list[Path]:
    """Write JUnit XML and coverage diagrams if requested; return the paths of the diagrams."""
    from modewright.api.spec_coverage import coverage_diagram
    from modewright.render import spec_tests as show_tests

    results = {junit: show_tests.junit_xml(runs)} if junit else {}
    pictures = {}
    if graphs:
        make_folder(graphs)
        pictures = {graphs / f"{c.name}.svg": coverage_diagram(c).svg().encode() for c in sums}
    write_files(results | pictures)
    return list(pictures)


def _print_json(runs: Sequence[TestRun], sums: Sequence[Coverage]) -> None:
    """Print tests, and coverage if measured, as JSON."""
    from modewright.api.spec_coverage import coverage_json
    from modewright.render.run import print_json
    from modewright.render.spec_tests import spec_test_json

    results = {**format_entry("tests"), "tests": [spec_test_json(run) for run in runs]}
    print_json(results | ({"coverage": [coverage_json(c) for c in sums]} if sums else {}))


def _report_end(runs: Sequence[TestRun], sums: Sequence[Coverage]) -> None:
    """Print the coverage and the numbers of passed and failed tests."""
    from modewright.api.spec_coverage import coverage_lines
    from modewright.render.spec_tests import spec_tests_summary

    for each in sums:
        _print_lines(coverage_lines(each))
    _print_lines([spec_tests_summary(runs)])


def _print_lines(lines: Iterable[str]) -> None:
    """Print lines without markup."""
    for line in lines:
        console().print(line, soft_wrap=True, highlight=False, markup=False)
