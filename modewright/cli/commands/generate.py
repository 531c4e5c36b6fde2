"""Command generate: write the C of automata."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.common.console import report_written_files
from modewright.cli.common.exit_codes import PROBLEMS
from modewright.cli.common.options import Calibrations, Sets, values_of
from modewright.runtime.output_files import make_folder, write_files


def generate(
    automaton: Annotated[str | None, typer.Argument(help="an automaton: name or file")] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="folder to write to")] = Path(
        "generated"
    ),
    sets: Sets = None,
    calibrations: Calibrations = None,
    every: Annotated[
        bool, typer.Option("--all", help="all automata below spec/ into generated/")
    ] = False,
    only_check: Annotated[
        bool,
        typer.Option(
            "--check", help="with --all: write nothing; exit with code 1 if a file is stale"
        ),
    ] = False,
    with_cmake: Annotated[
        bool, typer.Option("--cmake", help="also write CMakeLists.txt with the required flags")
    ] = False,
) -> None:
    """Generate C99 code of an automaton, sampled or continuous.

    \b
    modewright generate estimator --out build
    modewright generate estimator --out build --cmake
    modewright generate --all --check
    """
    from modewright.api import code_generation as code
    from modewright.api.stale_generated import generated_files

    if every == (automaton is not None):
        raise typer.BadParameter("name an automaton or use --all", param_hint="AUTOMATON")
    if every and with_cmake:
        raise typer.BadParameter("goes with an automaton, not with --all", param_hint="--cmake")
    if only_check:
        _exit_if_stale()
        return
    if automaton is not None:
        made = code.generate(automaton, values_of(sets), calibrations=calibrations or ())
        if with_cmake:
            made |= code.cmake(automaton, values_of(sets), calibrations=calibrations or ())
        files = {out / name: text.encode() for name, text in made.items()}
    else:
        files = generated_files(Path())
    for folder in {path.parent for path in files}:
        make_folder(folder)
    write_files(files)
    report_written_files(list(files))


def _exit_if_stale() -> None:
    """Print the stale files below `generated/` and exit with code 1 if there are any."""
    from modewright.api.stale_generated import stale_files

    lines = stale_files(Path())
    for line in lines:
        print(line, file=sys.stderr)
    if lines:
        print("run `modewright generate --all`", file=sys.stderr)
        raise typer.Exit(PROBLEMS)
