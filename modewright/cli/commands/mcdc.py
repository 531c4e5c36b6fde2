"""Command mcdc: measure MC/DC of generated C in the tests of a project."""

from __future__ import annotations

from typing import Annotated

import typer

from modewright.cli.common.console import console, progress_spinner
from modewright.cli.common.options import Calibrations, Json, Numbers, Sets, values_of


def mcdc(
    automaton: Annotated[str, typer.Argument(help="an automaton: its name or file")],
    runs: Annotated[int, typer.Option(min=0, help="runs of libFuzzer for further paths")] = 0,
    proofs: Annotated[
        bool, typer.Option(help="prove which uncovered conditions are infeasible")
    ] = True,
    numbers: Numbers = None,
    sets: Sets = None,
    calibrations: Calibrations = None,
    as_json: Json = False,
) -> None:
    """Measure MC/DC of the C of an automaton in the project's tests and at boundary values (clang).

    \b
    modewright mcdc supervisor
    modewright mcdc estimator_simple --runs 100000
    modewright mcdc estimator --no-proofs --json
    """
    from modewright.api import code_generation as code
    from modewright.render import code_verification as show_code, run as show

    with progress_spinner(f"running the C of {automaton} on the tests"):
        try:
            found = code.mcdc(
                automaton,
                runs,
                values_of(sets),
                None,
                calibrations or (),
                numbers,
                is_proven=proofs,
            )
        except ValueError as error:
            raise typer.BadParameter(str(error), param_hint="AUTOMATON") from None
    if as_json:
        show.print_json(show_code.mcdc_json(found))
    else:
        show_code.print_mcdc(console(), found)
