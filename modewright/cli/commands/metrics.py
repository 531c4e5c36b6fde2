"""Command metrics: measure memory and instructions of generated C on a microcontroller."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from modewright.cli.common.console import console, progress_spinner, report_written_files
from modewright.cli.common.options import Calibrations, Json, Numbers, Sets, values_of
from modewright.runtime.output_files import OutputError, require_writable, write_files

if TYPE_CHECKING:
    from codegen.harness.instruction_count import InstructionCounts

FORMATS = (".html", ".json")
"""Suffixes of files of metrics."""


def metrics(
    automata: Annotated[list[str], typer.Argument(help="automata: names or files")],
    system: Annotated[
        str | None,
        typer.Option(help="a system with instances of the automata, to count instructions"),
    ] = None,
    scenario: Annotated[
        str | None, typer.Option("--scenario", "-s", help="a scenario of the system: name or file")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="write .html or .json")] = None,
    numbers: Numbers = None,
    sets: Sets = None,
    calibrations: Calibrations = None,
    as_json: Json = False,
) -> None:
    """Measure the C of automata on a Cortex-M4F: ROM, RAM, stack, instructions of a step.

    With a system and a scenario the instructions are counted. The largest number of instructions of
    a step is always computed.

    \b
    modewright metrics estimator_float32 supervisor --out metrics.html
    modewright metrics estimator --numbers float32 --system ev_driveline -s tip_out
    """
    from modewright.api import code_generation as code
    from modewright.render import metrics as show_metrics

    if (system is None) != (scenario is None):
        raise typer.BadParameter("a system needs a scenario", param_hint="--system, --scenario")
    if out and out.suffix.lower() not in FORMATS:
        raise OutputError(f"{out}: metrics end with {' or '.join(FORMATS)}")
    require_writable(out)
    found = []
    for automaton in automata:
        with progress_spinner(f"compiling {automaton} for a Cortex-M4F"):
            given = values_of(sets), None, calibrations or (), numbers
            counts = _count_instructions(automaton, system, scenario, given)
            found.append((code.metrics(automaton, *given), counts))
    data = show_metrics.metrics_json(found)
    if out:
        text = show_metrics.metrics_html(found) if out.suffix.lower() == ".html" else None
        write_files({out: (text or json.dumps(data, indent=2) + "\n").encode()})
    if as_json:
        print(json.dumps(data, indent=2))
    else:
        console().print(show_metrics.metrics_table(found))
        for line in show_metrics.unbounded_lines(found):
            console().print(line, highlight=False)
        report_written_files([out] if out else [])


def _count_instructions(
    automaton: str, system: str | None, scenario: str | None, given: Any
) -> InstructionCounts | None:
    """Return the instruction counts in a scenario; None without system and scenario.

    Raises BadParameter if the system has no instance of the automaton.
    """
    from modewright.api import code_generation as code

    if not (system and scenario):
        return None
    try:
        return code.instructions(automaton, system, scenario, *given)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--system") from None
