"""Command effects: the physics that a diagnosis can name."""

from __future__ import annotations

from typing import Annotated

import typer

from modewright.cli.common.console import console, report_written_files
from modewright.cli.common.options import Json, Plot, picture_format, usage_errors
from modewright.runtime.output_files import require_writable, write_files


def effects(
    name: Annotated[str | None, typer.Argument(help="an effect, or `effect@place`")] = None,
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
    modewright effects                                        what can be laid, a line each
    modewright effects --at emps                              what fits a spec, and where
    modewright effects tyre_slip --at blind_driveline         what it changes in the equations
    modewright effects coulomb_friction@w_em --at blind_driveline --plot friction.png
    modewright effects torque_gain --at blind_driveline --plot gain.png --step 'T_em=80 N*m'
    """
    from modewright.api import effects as found
    from modewright.render import effects as show_effects, run as show

    if plot and name is None:
        raise typer.BadParameter("name the effect to be drawn", param_hint="--plot")
    form = picture_format(plot) if plot else ""
    require_writable(plot)
    if step and not plot:
        raise typer.BadParameter("say with --plot where the picture goes", param_hint="--step")
    listed = [found.find_effect(name, at)] if name else found.list_effects(at)
    if plot and name:
        with usage_errors():
            write_files({plot: found.draw_signature(name, at, step=step).data(form)})
    if as_json:
        show.print_json({"effects": [show_effects.effect_json(one) for one in listed]})
    elif name:
        show_effects.print_effect(console(), listed[0], at)
    else:
        show_effects.print_effects(console(), listed, at)
    if not as_json:
        report_written_files([plot] if plot else [])
