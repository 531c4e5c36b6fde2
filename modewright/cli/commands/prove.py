"""Command prove: check generated C with external tools."""

from __future__ import annotations

from typing import Annotated

import typer

from modewright.cli.common.console import console, progress_spinner
from modewright.cli.common.exit_codes import PROBLEMS
from modewright.cli.common.options import Calibrations, Json, Sets, values_of
from modewright.runtime.json_format import format_entry

Automaton = Annotated[str, typer.Argument(help="an automaton: its name or file")]
Only = Annotated[
    str | None,
    typer.Option(help="a list of warnings,misra,stack,sanitizers,values,contract; by default all"),
]


def prove(
    automaton: Automaton,
    only: Only = None,
    sets: Sets = None,
    calibrations: Calibrations = None,
    as_json: Json = False,
) -> None:
    """Check the C of an automaton with compilers, cppcheck (MISRA C:2012) and Frama-C.

    Exit code 1 if a check fails.

    \b
    modewright prove estimator_simple
    modewright prove supervisor --only misra,stack --json
    """
    from codegen.proofs.all import CHECKS
    from modewright.api import code_generation as code
    from modewright.render import code_verification as show_code, run as show

    checks = tuple(only.split(",")) if only else CHECKS
    unknown = sorted(set(checks) - set(CHECKS))
    if unknown:
        known = ", ".join(CHECKS)
        raise typer.BadParameter(f"{unknown[0]}: not one of {known}", param_hint="--only")
    with progress_spinner(f"checking the C of {automaton}"):
        verdicts = list(
            code.prove(automaton, values_of(sets), calibrations=calibrations or (), checks=checks)
        )
    if as_json:
        show.print_json(
            {
                **format_entry("proofs"),
                "automaton": automaton,
                "proofs": [show_code.proof_json(verdict) for verdict in verdicts],
            }
        )
    else:
        show_code.print_proofs(console(), verdicts)
    if not all(verdict.holds for verdict in verdicts):
        raise typer.Exit(PROBLEMS)
