"""Command trace: trace requirements to specs, lines of C and tests."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.common.console import console, progress_spinner, report_written_files
from modewright.cli.common.exit_codes import PROBLEMS
from modewright.cli.common.options import Json
from modewright.runtime.output_files import OutputError, require_writable, write_files

FORMATS = (".html", ".csv", ".json")
"""Suffixes of trace files."""


def trace(
    specs: Annotated[list[str], typer.Argument(help="automata or systems: names or files")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="write .html, .csv or .json")
    ] = None,
    requirements: Annotated[
        Path | None, typer.Option("--requirements", help="CSV file of requirements: name, text")
    ] = None,
    run: Annotated[
        bool, typer.Option("--run", help="run the tests and include their results")
    ] = False,
    strict: Annotated[
        bool, typer.Option("--strict", help="exit with code 1 if a requirement is not traced")
    ] = False,
    keys: Annotated[
        bool, typer.Option("--keys", help="trace keys of the specs to lines of C instead")
    ] = False,
    as_json: Json = False,
) -> None:
    """Trace requirements (`req:`) to specs, lines of their C, and tests.

    \b
    modewright trace ev_driveline
    modewright trace estimator --requirements needs.csv --run --out trace.html
    modewright trace estimator --keys --out keys.html
    """
    from modewright.api import traceability as traces
    from modewright.render import requirement_trace as show_trace

    form = out.suffix.lower() if out else ""
    if out and form not in FORMATS:
        raise OutputError(f"{out}: a trace ends with {', '.join(FORMATS)}")
    for option, is_used in (
        ("--requirements", requirements is not None),
        ("--run", run),
        ("--strict", strict),
    ):
        if keys and is_used:
            raise typer.BadParameter("leave it out: --keys has no requirements", param_hint=option)
    require_writable(out)
    if keys:
        _report_key_trace(specs, out, form, as_json)
        return
    with progress_spinner("tracing requirements"):
        found = traces.trace(specs, requirements, run=run)
    data = json.dumps(show_trace.trace_json(found), indent=2) + "\n"
    if out:
        page = show_trace.trace_html(found, ", ".join(specs)) if form == ".html" else data
        write_files({out: (show_trace.trace_csv(found) if form == ".csv" else page).encode()})
    if as_json:
        print(data, end="")
    else:
        for line in show_trace.trace_lines(found):
            console().print(line, soft_wrap=True, highlight=False, markup=False)
        report_written_files([out] if out else [])
    if strict and len(found.with_state("traced")) < len(found.requirements):
        raise typer.Exit(PROBLEMS)


def _report_key_trace(specs: list[str], out: Path | None, form: str, as_json: bool) -> None:
    """Trace keys to lines of C and write a page with both, or JSON."""
    from modewright.api import traceability as traces
    from modewright.render import key_trace as show_keys

    if form == ".csv":
        raise OutputError(f"{out}: a trace of keys ends with .html or .json")
    with progress_spinner("tracing keys"):
        traced = traces.trace_keys(specs)
    data = json.dumps(show_keys.key_traces_json(traced.traces), indent=2) + "\n"
    if out:
        title = f"Keys of {', '.join(specs)}"
        is_page = form == ".html"
        page = show_keys.key_traces_html(traced.traces, traced.specs, traced.code, title)
        write_files({out: (page if is_page else data).encode()})
    if as_json:
        print(data, end="")
    else:
        for line in show_keys.key_traces_lines(traced.traces):
            console().print(line, soft_wrap=True, highlight=False, markup=False)
        report_written_files([out] if out else [])
