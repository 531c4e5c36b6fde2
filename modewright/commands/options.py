"""Options: arguments that several commands share, and what is done with them."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from modewright.exits import PROBLEMS
from modewright.files import OutputError

if TYPE_CHECKING:
    from engine.trajectory import Trajectory

GRAPHIC_FORMATS = (".png", ".svg", ".pdf")

System = Annotated[str, typer.Argument(help="a system: its name or its file")]
Scenario = Annotated[str, typer.Option("--scenario", "-s", help="a scenario: name or file")]
Sets = Annotated[
    list[str] | None,
    typer.Option("--set", help="a parameter value: 'k_hs=6000 N*m/rad', 'est.t_wait=2 ms'"),
]
Out = Annotated[
    Path | None,
    typer.Option("--out", "-o", help="write the run: .csv (with a side file) or .parquet"),
]
Plot = Annotated[
    Path | None, typer.Option("--plot", "-p", help="write a picture: .png, .svg or .pdf")
]
Json = Annotated[bool, typer.Option("--json", help="print the result as JSON")]


def values_of(sets: Sequence[str] | None) -> dict[str, str]:
    """Return the values of --set by parameter."""
    found = {}
    for text in sets or []:
        name, equals, value = text.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise typer.BadParameter(f"`{text}` is not `parameter=value`", param_hint="--set")
        found[name.strip()] = value.strip()
    return found


def require_run(path: Path | None) -> None:
    """Raise OutputError, before any work is done, for a run in a format that is not known."""
    if path and path.suffix.lower() not in (".csv", ".parquet"):
        raise OutputError(f"{path}: a run ends with .csv or .parquet")


def graphic_format(path: Path) -> str:
    """Return the format of a picture by the ending of its name. Raises OutputError."""
    if path.suffix.lower() not in GRAPHIC_FORMATS:
        raise OutputError(f"{path}: a picture ends with {', '.join(GRAPHIC_FORMATS)}")
    return path.suffix.lower()[1:]


def stop_where(failed: bool, trajectory: Trajectory) -> None:
    """Warn of latched faults, tell why a run stopped; leave with exit code 1 if it failed."""
    for fault in trajectory.faults:
        print(f"warning: a fault bit is set: {fault}", file=sys.stderr)
    if trajectory.stopped:
        print(f"error: the run stopped: {trajectory.stopped}", file=sys.stderr)
    if failed:
        raise typer.Exit(PROBLEMS)
