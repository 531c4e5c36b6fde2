"""Command fuzz: compare generated C and engine on sequences that libFuzzer finds."""

from __future__ import annotations

from typing import Annotated

import typer

from modewright.cli.common.console import console, progress_spinner
from modewright.cli.common.exit_codes import PROBLEMS
from modewright.cli.common.options import Calibrations, Json, Numbers, Sets, values_of


def fuzz(
    automaton: Annotated[str, typer.Argument(help="a sampled automaton: its name or file")],
    runs: Annotated[int, typer.Option(min=1, help="number of sequences")] = 20_000,
    ticks: Annotated[
        int, typer.Option(min=1, max=64, help="largest number of ticks of a sequence")
    ] = 24,
    seed: Annotated[int, typer.Option(min=1, help="seed of the fuzzer")] = 1,
    numbers: Numbers = None,
    sets: Sets = None,
    calibrations: Calibrations = None,
    as_json: Json = False,
) -> None:
    """Search paths through the C of an automaton with libFuzzer and compare with the engine.

    The C runs under sanitizers. The engine repeats each sequence of inputs; all bits of outputs and
    retained variables must be equal.

    \b
    modewright fuzz estimator
    modewright fuzz supervisor --runs 200000 --json
    """
    from modewright.api import code_generation as code
    from modewright.render import code_verification as show_code, run as show

    with progress_spinner(f"trying {runs} sequences on {automaton}"):
        try:
            found = code.fuzz(
                automaton, runs, ticks, seed, values_of(sets), None, calibrations or (), numbers
            )
        except ValueError as error:
            raise typer.BadParameter(str(error), param_hint="AUTOMATON") from None
    if as_json:
        show.print_json(show_code.fuzzing_json(found))
    else:
        show_code.print_fuzzing(console(), found)
    if not found.is_clean:
        raise typer.Exit(PROBLEMS)
