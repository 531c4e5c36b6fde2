"""Command schema: print the JSON Schema of specs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.common.console import report_written_files
from modewright.cli.common.options import usage_errors
from modewright.runtime.output_files import require_writable, write_files


def schema(
    kind: Annotated[str | None, typer.Argument(help="one kind of file, e.g. automaton")] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="write to a file")] = None,
) -> None:
    """Print the JSON Schema (draft-07) of specs, with which editors complete and explain keys.

    \b
    modewright schema --out modewright.schema.json
    modewright schema automaton
    """
    from modewright.editing.json_schema import schema_text

    require_writable(out)
    with usage_errors():
        text = schema_text(kind)
    if out is None:
        print(text, end="")
        return
    write_files({out: text.encode()})
    report_written_files([out])
