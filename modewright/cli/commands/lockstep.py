"""Command lockstep: compare engine and compiled C bit by bit."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from modewright.cli.common.console import console, progress_spinner
from modewright.cli.common.options import (
    Calibrations,
    Json,
    Numbers,
    Scenario,
    Sets,
    System,
    report_run_end,
    values_of,
)
from modewright.runtime.json_format import format_entry

Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--change", help="change a tunable parameter at a time: '1.5 s: k_hs = 6000 N*m/rad'"
    ),
]
Compiler = Annotated[
    str | None, typer.Option(help="C compiler such as gcc or clang; by default $CC")
]
Optimise = Annotated[
    Literal["O0", "O1", "O2", "O3", "Os"], typer.Option(help="optimisation level of the C compiler")
]

Target = Annotated[
    Literal["host", "cortex-m4f"],
    typer.Option(help="where the C runs: here, or on an emulated Cortex-M4F (QEMU)"),
]


def lockstep(
    system: System,
    scenario: Scenario,
    sets: Sets = None,
    calibrations: Calibrations = None,
    numbers: Numbers = None,
    changes: Changes = None,
    compiler: Compiler = None,
    optimise: Optimise = "O2",
    target: Target = "host",
    as_json: Json = False,
) -> None:
    """Compare engine and compiled C at each tick, bit by bit.

    Exit code 1 if a bit differs, nothing was compared, or the run stopped.

    \b
    modewright lockstep ev_driveline -s tip_out --numbers float32 --optimise O3
    modewright lockstep ev_driveline -s tip_out --target cortex-m4f
    """
    from modewright.api import simulation as api
    from modewright.render import run as show

    with progress_spinner(f"simulating {system}, {scenario}, and running its C"):
        trajectory, verdicts = api.lockstep(
            system,
            scenario,
            values_of(sets),
            numbers=numbers,
            changes=changes or (),
            compiler=compiler,
            optimise=optimise,
            calibrations=calibrations or (),
            target=target,
        )
    if as_json:
        found = {"lockstep": [show.verdict_json(verdict) for verdict in verdicts]}
        show.print_json({**show.trajectory_json(trajectory), **format_entry("lockstep"), **found})
    else:
        show.print_verdicts(console(), verdicts)
    is_compared = any(verdict.ticks for verdict in verdicts)
    is_equal = is_compared and all(verdict.is_equal for verdict in verdicts)
    report_run_end(trajectory.stopped is not None or not is_equal, trajectory)
