"""Command explain: print a spec after each stage, what a pass changes, where values come from."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from modewright.cli.common.options import Json, Sets, values_of

STAGES = ("document", "model", "lowered", "program", "numbers")
"""The stages at which a spec can be printed."""
PASSES = (
    *("parameters", "inputs", "common-subexpressions", "unused-parameters"),
    *("step", "unread-results", "range-checks", "fast-path", "inlining"),
)
"""The passes from Program to Program in their order; the first line has those of the language."""


def explain(
    spec: Annotated[str, typer.Argument(help="a spec: name or file")],
    other: Annotated[
        str | None, typer.Argument(help="a second spec: print the differences")
    ] = None,
    stage: Annotated[
        str,
        typer.Option(
            "--pass",
            help="a stage: document (expanded), model (checked), lowered, program, numbers; "
            f"or what a pass changes: {', '.join(PASSES)}",
        ),
    ] = "document",
    stop_after: Annotated[
        str | None,
        typer.Option("--stop-after", help="a pass or `lowered`: print the Program after it"),
    ] = None,
    sets: Sets = None,
    as_json: Json = False,
) -> None:
    """Print a spec with variants and effects applied, and the origin of each value.

    With two specs, print their differences. Other stages print the checked model, the Program or
    the solved numbers; the name of a pass prints the Program before and after it as a difference.

    \b
    modewright explain driveline_load
    modewright explain driveline driveline_load
    modewright explain estimator --pass program
    modewright explain estimator --pass fast-path
    modewright explain estimator --stop-after parameters
    modewright explain estimator --pass numbers
    """
    from modewright.api import pass_output as explaining

    if stage not in (*STAGES, *PASSES):
        raise typer.BadParameter(f"one of {', '.join((*STAGES, *PASSES))}", param_hint="--pass")
    if stop_after is not None and stop_after not in ("lowered", *PASSES):
        choices = ", ".join(("lowered", *PASSES))
        raise typer.BadParameter(f"one of {choices}", param_hint="--stop-after")
    if stop_after and (other or stage != "document"):
        raise typer.BadParameter("leave out --pass and the second spec", param_hint="--stop-after")
    if as_json and (stop_after or stage != "document"):
        raise typer.BadParameter("the document only is printed as JSON", param_hint="--json")
    values = values_of(sets)
    if as_json and other:
        print(json.dumps(explaining.spec_differences_json(spec, other), indent=2))
    elif as_json:
        print(json.dumps(explaining.spec_json(spec), indent=2))
    elif other:
        differences = explaining.compare_specs(spec, other, stage, values)  # type: ignore[arg-type]
        print(differences or "no differences\n", end="")
    elif stop_after:
        print(explaining.program_after(spec, stop_after, values), end="")
    else:
        print(explaining.explain_spec(spec, stage, values), end="")  # type: ignore[arg-type]
