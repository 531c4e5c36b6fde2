"""Command effects: list and draw the effects that a diagnosis can find."""

from __future__ import annotations

from typing import Annotated

import typer

from modewright.cli.common.console import console, report_written_files
from modewright.cli.common.options import Json, Plot, picture_format, usage_errors
from modewright.runtime.json_format import format_entry
from modewright.runtime.output_files import require_writable, write_files


def effects(
    name: Annotated[str | None, typer.Argument(help="an effect, or effect@place")] = None,
    at: Annotated[
        str | None, typer.Option("--at", help="a spec: list the places where effects fit")
    ] = None,
    plot: Plot = None,
    step: Annotated[
        str | None, typer.Option("--step", help="the input step of the figure: 'T_em=40 N*m'")
    ] = None,
    as_json: Json = False,
) -> None:
    """List the effects that can be applied to a model; describe or draw one of them.

    \b
    modewright effects                                        all effects, one line each
    modewright effects --at emps                              effects that fit a spec, with places
    modewright effects tyre_slip --at blind_driveline         the changes of the equations
    modewright effects coulomb_friction@w_em --at blind_driveline --plot friction.png
    modewright effects torque_gain --at blind_driveline --plot gain.png --step 'T_em=80 N*m'
    """
    from modewright.api import effects as library
    from modewright.render import effects as show_effects, run as show

    if plot and name is None:
        raise typer.BadParameter("name the effect to draw", param_hint="--plot")
    form = picture_format(plot) if plot else ""
    require_writable(plot)
    if step and not plot:
        raise typer.BadParameter("say with --plot where the figure goes", param_hint="--step")
    listed = [library.find_effect(name, at)] if name else library.list_effects(at)
    if plot and name:
        with usage_errors():
            write_files({plot: library.draw_signature(name, at, step=step).data(form)})
    if as_json:
        entries = [show_effects.effect_json(one) for one in listed]
        show.print_json({**format_entry("effects"), "effects": entries})
    elif name:
        show_effects.print_effect(console(), listed[0], at)
    else:
        show_effects.print_effects(console(), listed, at)
    if not as_json:
        report_written_files([plot] if plot else [])
