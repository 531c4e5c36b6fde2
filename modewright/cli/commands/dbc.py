"""Command dbc: write inputs and outputs of an automaton as CAN messages."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.common.console import report_written_files
from modewright.cli.common.options import Calibrations, Sets, values_of
from modewright.runtime.output_files import require_writable, write_files


def dbc(
    automaton: Annotated[str, typer.Argument(help="an automaton: its name or file")],
    out: Annotated[Path, typer.Option("--out", "-o", help="write .dbc")],
    first: Annotated[str, typer.Option(help="identifier of the first CAN message")] = "0x100",
    is_fd: Annotated[
        bool, typer.Option("--fd", help="use CAN FD frames of up to 64 bytes")
    ] = False,
    sets: Sets = None,
    calibrations: Calibrations = None,
) -> None:
    """Write a CAN database (DBC) of the inputs and outputs of an automaton.

    Each signal has the bits of its C type.

    \b
    modewright dbc supervisor --out supervisor.dbc
    modewright dbc estimator --fd --first 0x320 --out estimator.dbc
    """
    from modewright.api import code_generation as code

    require_writable(out)
    identifier = _identifier_of(first)
    try:
        text = code.dbc(
            automaton, identifier, values_of(sets), None, calibrations or (), is_fd=is_fd
        )
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--first") from None
    write_files({out: text.encode("ascii")})
    report_written_files([out])


def _identifier_of(text: str) -> int:
    """Return the whole number of --first. Raises BadParameter for another text."""
    try:
        return int(text, 0)
    except ValueError:
        label = f"`{text}` is not a whole number such as `0x320` or `800`"
        raise typer.BadParameter(label, param_hint="--first") from None
