"""Command new: create a project."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.common.console import console, report_written_files
from modewright.cli.common.options import usage_errors


def new(
    name: Annotated[str, typer.Argument(help="name of the project and of its system")],
    folder: Annotated[
        Path | None, typer.Option("--out", "-o", help="folder to create [default: the name]")
    ] = None,
) -> None:
    """Create a project with a plant, a controller, a scenario and a test.

    \b
    modewright new warm_room
    """
    from modewright.api.new_project import write_skeleton

    place = folder or Path(name)
    with usage_errors():
        report_written_files(write_skeleton(name, place))
    console().print(
        f"next: cd {place} && modewright simulate {name} -s cold_day --plot cold_day.png",
        highlight=False,
        soft_wrap=True,
    )
