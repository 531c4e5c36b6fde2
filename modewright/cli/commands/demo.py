"""Command demo: simulate the example, compare it with its C and draw it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.common.console import console
from modewright.cli.common.exit_codes import PROBLEMS
from modewright.runtime.output_files import make_folder


def demo(
    out: Annotated[Path, typer.Option("--out", "-o", help="folder for the picture")] = Path(
        "build"
    ),
) -> None:
    """Run the example: a tip-out of an EV driveline, engine against C, with a figure.

    \b
    modewright demo --out build
    """
    from modewright.render.demo import run_demo

    make_folder(out)
    if not run_demo(out, console()):
        raise typer.Exit(PROBLEMS)
