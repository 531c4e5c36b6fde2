"""Command test: tests of specs on the engine and in C."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.commands.options import Json
from modewright.console import console, working
from modewright.exits import PROBLEMS
from modewright.files import require_writable, write_files


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
    as_json: Json = False,
) -> None:
    """Run tests of specs on the engine and in C; both have to give one verdict.

    \b
    modewright test
    modewright test tip_out_is_detected --junit build/tests.xml
    """
    from modewright import show_tests
    from modewright.show import print_json
    from modewright.tests import run_tests

    require_writable(junit)
    runs = []
    with working("running tests"):
        for run in run_tests(tests or (), compiled=not interpreted):
            runs.append(run)
            for line in show_tests.lines_of(run) if not as_json else ():
                console().print(line, soft_wrap=True, highlight=False, markup=False)
    if junit:
        write_files({junit: show_tests.junit(runs)})
    if as_json:
        print_json({"tests": [show_tests.test_json(run) for run in runs]})
    else:
        console().print(show_tests.summary(runs), highlight=False)
    if not all(run.passed for run in runs):
        raise typer.Exit(PROBLEMS)
