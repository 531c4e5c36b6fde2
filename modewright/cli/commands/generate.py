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

DEFAULT_FOLDER = Path("generated")
"""Folder of generated C without `--out`, below the working folder."""


def generate(
    automaton: Annotated[str | None, typer.Argument(help="an automaton: name or file")] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="folder to write to")] = DEFAULT_FOLDER,
    sets: Sets = None,
    calibrations: Calibrations = None,
    every: Annotated[
        bool,
        typer.Option("--all", help="all automata below spec/, each into its folder below --out"),
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
    modewright generate --all --out build
    """
    from modewright.api import code_generation as code
    from modewright.api.stale_generated_code import generated_files

    if every == (automaton is not None):
        raise typer.BadParameter("name an automaton or use --all", param_hint="AUTOMATON")
    for option, is_used in (
        ("--cmake", with_cmake),
        ("--set", sets),
        ("--calibration", calibrations),
    ):
        if every and is_used:
            raise typer.BadParameter("goes with an automaton, not with --all", param_hint=option)
    if only_check and not every:
        raise typer.BadParameter("goes with --all, not with an automaton", param_hint="--check")
    if only_check:
        _exit_if_stale(out)
        return
    if automaton is not None:
        made = code.generate(automaton, values_of(sets), calibrations=calibrations or ())
        if with_cmake:
            made |= code.cmake(automaton, values_of(sets), calibrations=calibrations or ())
        files = {out / name: text.encode() for name, text in made.items()}
    else:
        files = generated_files(Path(), out)
    for folder in {path.parent for path in files}:
        make_folder(folder)
    write_files(files)
    report_written_files(list(files))


def _exit_if_stale(out: Path) -> None:
    """Print the stale files below the folder `out` and exit with code 1 if there are any."""
    from modewright.api.stale_generated_code import stale_files

    lines = stale_files(Path(), out)
    for line in lines:
        print(line, file=sys.stderr)
    if lines:
        folder = "" if out == DEFAULT_FOLDER else f" --out {out}"
        print(f"run `modewright generate --all{folder}`", file=sys.stderr)
        raise typer.Exit(PROBLEMS)
