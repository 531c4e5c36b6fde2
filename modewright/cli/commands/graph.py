"""Command graph: draw modes and transitions of an automaton."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from modewright.cli.common.console import report_written_files
from modewright.runtime.output_files import OutputError, require_writable, write_files

if TYPE_CHECKING:
    from modewright.diagram.diagram import Diagram

FORMATS = (".svg", ".mmd", ".md")
"""Suffixes of diagram files."""


def graph(
    automaton: Annotated[str, typer.Argument(help="an automaton: name or file")],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="write .svg, .mmd or .md; by default print Mermaid"),
    ] = None,
    tests: Annotated[
        bool, typer.Option("--tests", help="colour an .svg by the coverage of the project's tests")
    ] = False,
) -> None:
    """Draw the modes of an automaton with guards, waits, priorities and resets.

    \b
    modewright graph estimator
    modewright graph estimator --out estimator.svg
    modewright graph estimator --tests --out covered.svg
    """
    form = out.suffix.lower() if out else ""
    if out and form not in FORMATS:
        raise OutputError(f"{out}: a diagram ends with {', '.join(FORMATS)}")
    require_writable(out)
    if tests and form != ".svg":
        raise typer.BadParameter("colours are for --out with .svg", param_hint="--tests")
    drawn = _load_diagram(automaton, tests)
    text = drawn.svg() if form == ".svg" else drawn.mermaid()
    if out is None:
        print(text, end="")
        return
    write_files({out: (f"```mermaid\n{text}```\n" if form == ".md" else text).encode()})
    report_written_files([out])


def _load_diagram(automaton: str, tests: bool) -> Diagram:
    """Return the diagram of an automaton, shaded by test coverage if requested."""
    if tests:
        from modewright.api.spec_coverage import project_coverage_diagram

        return project_coverage_diagram(automaton)
    from modewright.diagram.diagram import graph as diagram

    return diagram(automaton)
