"""Command demo: show the product at work, on an example or on simulated recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from modewright.cli.commands.diagnose import report_progress
from modewright.cli.common.console import console, report_written_files
from modewright.cli.common.exit_codes import EXIT_CODES, PROBLEMS
from modewright.cli.common.options import Json
from modewright.runtime.output_files import make_folder

demo = typer.Typer(rich_markup_mode=None, epilog=EXIT_CODES)


@demo.callback(invoke_without_command=True, epilog=EXIT_CODES)
def _demo(
    context: typer.Context,
    out: Annotated[Path, typer.Option("--out", "-o", help="folder for the picture")] = Path(
        "build"
    ),
) -> None:
    """Run the example: a tip-out of an EV driveline, engine against C, with a figure.

    The command `diagnose` finds a concealed effect in simulated recordings instead.

    \b
    modewright demo --out build
    modewright demo diagnose
    modewright demo recordings --out recordings
    """
    if context.invoked_subcommand is not None:
        source = context.get_parameter_source("out")
        if source is not None and source.name == "COMMANDLINE":
            text = f"give it after `{context.invoked_subcommand}`"
            raise typer.BadParameter(text, param_hint="--out")
        return
    from modewright.render.demo import run_demo

    make_folder(out)
    if not run_demo(out, console()):
        raise typer.Exit(PROBLEMS)


@demo.command(epilog=EXIT_CODES)
def diagnose(
    machine: Annotated[
        Literal["friction", "hysteresis"],
        typer.Argument(help="friction: a driveline; hysteresis: its half-shafts in tip-outs"),
    ] = "friction",
    out: Annotated[
        Path, typer.Option("--out", "-o", help="folder for recordings and report")
    ] = Path("build/demo"),
    as_json: Json = False,
) -> None:
    """Diagnose simulated recordings with a concealed effect, and compare the verdict with it.

    The folder gets the recordings and a report. Exit code 1 if the verdict is not the truth.

    \b
    modewright demo diagnose
    modewright demo diagnose hysteresis --out build/demo
    modewright demo diagnose --json
    """
    from modewright.api.demo_data import MACHINES, diagnose_demo
    from modewright.render import run as show
    from modewright.render.demo_diagnosis import demo_diagnosis_json, print_demo_diagnosis

    report_progress(f"simulated recordings: {MACHINES[machine].about}")
    report_progress(f"the model {MACHINES[machine].spec} lacks this; the diagnosis is not told")
    found = diagnose_demo(machine, out, report_progress)
    if as_json:
        show.print_json(demo_diagnosis_json(found, out))
    else:
        print_demo_diagnosis(console(), found, out)
    if not found.is_right:
        raise typer.Exit(PROBLEMS)


@demo.command(epilog=EXIT_CODES)
def recordings(
    out: Annotated[Path, typer.Option("--out", "-o", help="folder for the files")] = Path(
        "build/demo"
    ),
) -> None:
    """Write the simulated recordings into a folder: two machines, and a drive of an EV.

    \b
    modewright demo recordings --out recordings
    """
    from modewright.api.demo_data import write_demo_data

    write_demo_data(out)
    report_written_files([out / "README.md", out / "recordings", out / "spec"])
