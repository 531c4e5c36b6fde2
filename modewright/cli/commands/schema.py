"""Command schema: the JSON Schema of specs, for editors."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.common.console import report_written_files
from modewright.cli.common.options import usage_errors
from modewright.runtime.output_files import require_writable, write_files


def schema(
    kind: Annotated[str | None, typer.Argument(help="of one kind of file: automaton ...")] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="write it to a file")] = None,
) -> None:
    """Print the JSON Schema of specs (draft-07), from which editors complete and explain keys.

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
