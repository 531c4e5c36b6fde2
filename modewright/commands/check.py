"""Command check: all problems of specs."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from modewright.commands.options import Json
from modewright.console import console, counted
from modewright.exits import MOST_SHOWN, PROBLEMS


def check(
    specs: Annotated[list[str] | None, typer.Argument(help="specs: names or files")] = None,
    every: Annotated[bool, typer.Option("--all", help="every spec below spec/")] = False,
    as_json: Json = False,
) -> None:
    """Report all problems of specs, with places and help.

    \b
    modewright check estimator spec/ev_driveline/plant.yaml
    modewright check --all --json
    """
    from language.problem import ordered, render_all
    from modewright import checking

    names = list(specs or []) + (
        [str(path) for path in checking.spec_files(Path())] if every else []
    )
    if not names:
        raise typer.BadParameter("name a spec, or use --all", param_hint="SPECS")
    found = [checking.checked(name) for name in names]
    problems = ordered(problem for each in found for problem in each.problems)
    errors = [problem for problem in problems if problem.severity == "error"]
    if as_json:
        told = [checking.problem_json(problem) for problem in problems]
        print(json.dumps({"problems": told}, indent=2, allow_nan=False))
    elif problems:
        print(render_all(problems[:MOST_SHOWN]), file=sys.stderr)
        if len(problems) > MOST_SHOWN:
            print(f"\n... and {len(problems) - MOST_SHOWN} more: --json", file=sys.stderr)
    if not as_json:
        console().print(f"{counted(len(names), 'spec')} checked, {counted(len(errors), 'problem')}")
    if errors:
        raise typer.Exit(PROBLEMS)
    for each in found[: len(specs or [])] if not as_json else ():
        for line in each.limits:
            console().print(line, soft_wrap=True, highlight=False, markup=False)
