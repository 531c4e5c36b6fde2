"""Command test: tests of specs on the engine and in C."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.commands.options import Json
from modewright.console import announce, console, working
from modewright.exits import PROBLEMS
from modewright.files import make_folder, require_writable, write_files


def test(
    tests: Annotated[
        list[str] | None, typer.Argument(help="tests: names or files; all of the project")
    ] = None,
    junit: Annotated[
        Path | None, typer.Option("--junit", help="write the results as JUnit XML")
    ] = None,
    interpreted: Annotated[
        bool, typer.Option("--interpreted", help="on the engine alone: no compiler is needed")
    ] = False,
    coverage: Annotated[
        bool,
        typer.Option("--coverage", help="tell which modes, transitions, conditions are tested"),
    ] = False,
    graphs: Annotated[
        Path | None, typer.Option("--graphs", help="a folder for the modes, coloured by coverage")
    ] = None,
    as_json: Json = False,
) -> None:
    """Run tests of specs on the engine and in C; both have to give one verdict.

    \b
    modewright test
    modewright test tip_out_is_detected --junit build/tests.xml
    modewright test --coverage --graphs build
    """
    from expectation.coverage import Coverage, coverage as covered, together
    from modewright import show_tests
    from modewright.covered import coverage_json, covered_graph, lines_of
    from modewright.show import print_json
    from modewright.tests import run_tests

    require_writable(junit)
    runs = []
    parts: list[Coverage] = []
    with working("running tests"):
        for run in run_tests(tests or (), compiled=not interpreted):
            runs.append(run)
            parts += covered(run.test) if coverage or graphs else ()
            for line in show_tests.lines_of(run) if not as_json else ():
                _tell(line)
    sums = together(parts)
    files = {junit: show_tests.junit(runs)} if junit else {}
    if graphs:
        make_folder(graphs)
        files |= {graphs / f"{c.name}.svg": covered_graph(c).svg().encode() for c in sums}
    write_files(files)
    if as_json:
        told = {"tests": [show_tests.test_json(run) for run in runs]}
        print_json(told | ({"coverage": [coverage_json(c) for c in sums]} if sums else {}))
    else:
        for line in (line for each in sums for line in lines_of(each)):
            _tell(line)
        _tell(show_tests.summary(runs))
        announce([path for path in files if path != junit])
    if not all(run.passed for run in runs):
        raise typer.Exit(PROBLEMS)


def _tell(line: str) -> None:
    console().print(line, soft_wrap=True, highlight=False, markup=False)
