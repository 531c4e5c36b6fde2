"""Command explain: print a spec after each pass, with the origin of each value."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from modewright.cli.common.options import Json, Sets, values_of

PASSES = ("document", "model", "lowered", "parameters", "inputs", "program", "numbers")
"""The passes after which a spec can be printed."""


def explain(
    spec: Annotated[str, typer.Argument(help="a spec: name or file")],
    other: Annotated[
        str | None, typer.Argument(help="a second spec: print the differences")
    ] = None,
    stage: Annotated[
        str,
        typer.Option(
            "--pass",
            help="document (expanded), model (checked), lowered, parameters, inputs, program, "
            "numbers",
        ),
    ] = "document",
    sets: Sets = None,
    as_json: Json = False,
) -> None:
    """Print a spec with variants and effects applied, and the origin of each value.

    With two specs, print their differences. Other passes print the checked model, the Program or
    the solved numbers.

    \b
    modewright explain driveline_load
    modewright explain driveline driveline_load
    modewright explain estimator --pass program
    modewright explain estimator --pass numbers
    """
    from modewright.api import pass_output as explaining

    if stage not in PASSES:
        raise typer.BadParameter(f"one of {', '.join(PASSES)}", param_hint="--pass")
    if as_json and stage != "document":
        raise typer.BadParameter("the document only is printed as JSON", param_hint="--json")
    values = values_of(sets)
    if as_json and other:
        print(json.dumps(explaining.spec_differences_json(spec, other), indent=2))
    elif as_json:
        print(json.dumps(explaining.spec_json(spec), indent=2))
    elif other:
        differences = explaining.compare_specs(spec, other, stage, values)  # type: ignore[arg-type]
        print(differences or "no differences\n", end="")
    else:
        print(explaining.explain_spec(spec, stage, values), end="")  # type: ignore[arg-type]
