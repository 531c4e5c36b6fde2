"""Command prove: generated C under the tools that an ECU's code has to pass."""

from __future__ import annotations

from typing import Annotated

import typer

from modewright.cli.common.console import console, progress_spinner
from modewright.cli.common.exit_codes import PROBLEMS
from modewright.cli.common.options import Calibrations, Json, Sets, values_of

Automaton = Annotated[str, typer.Argument(help="an automaton: its name or file")]
Only = Annotated[
    str | None,
    typer.Option(help="some of warnings,misra,stack,sanitizers,values,contract; all by default"),
]


def prove(
    automaton: Automaton,
    only: Only = None,
    sets: Sets = None,
    calibrations: Calibrations = None,
    as_json: Json = False,
) -> None:
    """Check the C of an automaton by compilers, cppcheck (MISRA C:2012) and Frama-C.

    \b
    modewright prove estimator_simple
    modewright prove supervisor --only misra,stack --json
    """
    from codegen.proofs.all import CHECKS
    from modewright.api import code_generation as code
    from modewright.render import code as show_code, run as show

    checks = tuple(only.split(",")) if only else CHECKS
    unknown = sorted(set(checks) - set(CHECKS))
    if unknown:
        known = ", ".join(CHECKS)
        raise typer.BadParameter(f"{unknown[0]}: not one of {known}", param_hint="--only")
    with progress_spinner(f"checking the C of {automaton}"):
        made = code.prove(
            automaton, values_of(sets), calibrations=calibrations or (), checks=checks
        )
        found = list(made)
    if as_json:
        show.print_json(
            {"automaton": automaton, "proofs": [show_code.proof_json(p) for p in found]}
        )
    else:
        show_code.print_proofs(console(), found)
    if not all(proof.holds for proof in found):
        raise typer.Exit(PROBLEMS)
