"""Command a2l: write the A2L description of generated C."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.common.console import console, report_written_files
from modewright.cli.common.options import Calibrations, Sets, values_of
from modewright.runtime.output_files import OutputError, require_writable, write_files


def a2l(
    automaton: Annotated[str, typer.Argument(help="an automaton: its name or file")],
    out: Annotated[Path, typer.Option("--out", "-o", help="write .a2l")],
    elf: Annotated[
        Path | None,
        typer.Option("--elf", help="linked program with debug information (-g), for addresses"),
    ] = None,
    page: Annotated[
        str | None,
        typer.Option(help="the structure of the calibration page; default X_default_cal"),
    ] = None,
    instance: Annotated[
        str | None, typer.Option(help="the instance if the program has several: 'app.left'")
    ] = None,
    sets: Sets = None,
    calibrations: Calibrations = None,
) -> None:
    """Write the A2L file (ASAM MCD-2 MC 1.7.1) of the C of an automaton.

    It lists measurements and tunable parameters for a measurement and calibration tool. Addresses
    come from the linked program.

    \b
    modewright a2l estimator --out estimator.a2l --elf ecu.elf
    modewright a2l estimator --out left.a2l --elf ecu.elf --instance app.left --page left_page
    """
    from codegen.exchange.a2l.elf_addresses import ImageError
    from modewright.api import code_generation as code

    require_writable(out)
    given = values_of(sets), calibrations or ()
    try:
        text = code.a2l(automaton, elf, page, instance, given[0], calibrations=given[1])
    except ImageError as error:
        raise OutputError(str(error)) from None
    write_files({out: text.encode("ascii")})
    report_written_files([out])
    if lacks := _missing_addresses(text, elf):
        console().print(lacks, highlight=False, soft_wrap=True, markup=False)


def _missing_addresses(text: str, elf: Path | None) -> str:
    """Return a note about missing addresses in an A2L text; empty if there are none."""
    if elf is None:
        return "it has no addresses: link the C with -g and give the program by --elf"
    if "/begin MEASUREMENT" in text and "ECU_ADDRESS" not in text:
        return f"its measurements have no addresses: {elf} has no instance of the automaton"
    return ""
