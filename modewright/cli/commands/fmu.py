"""Command fmu: export an automaton as a functional mock-up unit (FMI)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from modewright.cli.common.console import progress_spinner, report_written_files
from modewright.cli.common.options import Calibrations, Sets, usage_errors, values_of
from modewright.runtime.output_files import require_writable, write_files

if TYPE_CHECKING:
    from codegen.exchange.fmi.variable import Version

Automaton = Annotated[str, typer.Argument(help="an automaton: its name or file")]
FmiVersion = Annotated[int, typer.Option("--version", min=2, max=3, help="version of FMI: 2 or 3")]
Out = Annotated[
    Path | None, typer.Option("--out", "-o", help="file to write; by default the name with .fmu")
]
SourceOnly = Annotated[bool, typer.Option("--source-only", help="sources only, no binary")]


def fmu(
    automaton: Automaton,
    version: FmiVersion = 3,
    out: Out = None,
    source_only: SourceOnly = False,
    sets: Sets = None,
    calibrations: Calibrations = None,
) -> None:
    """Export an automaton as an FMU for co-simulation, with C sources and a binary.

    \b
    modewright fmu estimator --out estimator.fmu
    modewright fmu estimator --version 2 --set 'k_hs=6000 N*m/rad'
    modewright fmu supervisor --source-only
    """
    from modewright.api import code_generation as code

    place = out or Path(f"{Path(automaton).stem}.fmu")
    require_writable(place)
    with progress_spinner(f"packing {automaton}"), usage_errors():
        packed = code.fmu(
            automaton,
            cast("Version", version),
            values_of(sets),
            calibrations=calibrations or (),
            is_source_only=source_only,
        )
    write_files({place: packed})
    report_written_files([place])
