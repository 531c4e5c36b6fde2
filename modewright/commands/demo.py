"""Command demo: the product at work."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.console import console
from modewright.exits import PROBLEMS
from modewright.files import make_folder


def demo(
    out: Annotated[Path, typer.Option("--out", "-o", help="folder for the picture")] = Path(
        "build"
    ),
) -> None:
    """Show the product: a tip-out, engine against C, a picture.

    \b
    modewright demo --out build
    """
    from modewright import demo as shown

    make_folder(out)
    if not shown.run_demo(out, console()):
        raise typer.Exit(PROBLEMS)
