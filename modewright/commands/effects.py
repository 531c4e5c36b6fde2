"""Command effects: the physics that a diagnosis can name."""

from __future__ import annotations

from typing import Annotated

import typer

from modewright.commands.options import Json, Plot, graphic_format, usage_errors
from modewright.console import announce, console
from modewright.files import require_writable, write_files


def effects(
    name: Annotated[
        str | None, typer.Argument(help="an effect, or `effect@place` for a picture")
    ] = None,
    at: Annotated[
        str | None, typer.Option("--at", help="a spec: tell which of its places effects fit")
    ] = None,
    plot: Plot = None,
    step: Annotated[
        str | None, typer.Option("--step", help="what the picture steps: 'T_em=40 N*m'")
    ] = None,
    as_json: Json = False,
) -> None:
    """List the effects that can be laid over a model, explain one, draw how it shows.

    \b
    modewright effects
    modewright effects --at emps
    modewright effects tyre_slip --at blind_driveline --plot tyre_slip.png
    """
    from modewright import effects as found, show, show_effects

    if plot and name is None:
        raise typer.BadParameter("name the effect to be drawn", param_hint="--plot")
    form = graphic_format(plot) if plot else ""
    require_writable(plot)
    plain = name.partition("@")[0] if name else None
    listed = [found.effect(plain, at)] if plain else found.effects(at)
    if plot and name:
        with usage_errors():
            write_files({plot: found.signature(name, at, step=step).data(form)})
    if as_json:
        show.print_json({"effects": [show_effects.effect_json(one) for one in listed]})
    elif plain:
        show_effects.print_effect(console(), listed[0], at)
    else:
        show_effects.print_effects(console(), listed, at)
    if not as_json:
        announce([plot] if plot else [])
