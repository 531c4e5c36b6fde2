"""Command diff: print the differences of two specs in terms of the language."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.common.console import report_written_files
from modewright.cli.common.exit_codes import PROBLEMS
from modewright.cli.common.options import Json
from modewright.runtime.output_files import require_writable, write_files


def diff(
    before: Annotated[str, typer.Argument(help="a spec: name or file; also REVISION:name or file")],
    after: Annotated[str, typer.Argument(help="another spec of the same kind")],
    html: Annotated[Path | None, typer.Option(help="write an HTML page")] = None,
    as_json: Json = False,
    exit_code: Annotated[
        bool, typer.Option("--exit-code", help="exit with code 1 if the specs differ")
    ] = False,
) -> None:
    """Print the differences of two specs: values, guards, waits, modes, equations.

    A spec may be of a Git revision.

    \b
    modewright diff driveline driveline_load
    modewright diff HEAD~1:spec/ev_driveline/plant.yaml driveline --html diff.html
    """
    from modewright.editing.spec_diff.difference import diff_documents
    from modewright.editing.spec_diff.git_revision import load_documents
    from modewright.editing.spec_diff.rendering import diff_html, diff_json, diff_text

    require_writable(html)
    with load_documents(before, after) as (old, new):
        changes = diff_documents(old, new)
    if as_json:
        print(json.dumps(diff_json(changes), indent=2))
    else:
        print(diff_text(changes) or "no differences\n", end="")
    if html:
        write_files({html: diff_html(changes, before, after).encode()})
        if not as_json:
            report_written_files([html])
    if exit_code and changes:
        raise typer.Exit(PROBLEMS)
