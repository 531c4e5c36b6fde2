"""Command explain: the Program that engine and generator share."""

from __future__ import annotations

from typing import Annotated

import typer

from modewright.commands.options import Sets, values_of


def explain(
    automaton: Annotated[str, typer.Argument(help="an automaton: name or file")], sets: Sets = None
) -> None:
    """Print the Program that engine and generator share.

    \b
    modewright explain estimator
    """
    from language.printing import program_text
    from modewright import api

    print(program_text(api.program(automaton, values_of(sets))), end="")
