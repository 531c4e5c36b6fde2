"""Command format: specs laid out by rules."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.common.console import console
from modewright.cli.common.exit_codes import PROBLEMS
from modewright.render.text import pluralise
from modewright.runtime.output_files import require_writable_location, write_files


def format(
    files: Annotated[list[Path], typer.Argument(help="specs, or folders of specs")],
    check: Annotated[
        bool, typer.Option("--check", help="write nothing; exit code 1 if a file would change")
    ] = False,
) -> None:
    """Lay specs out: indentation, blanks, alignment; comments, quotes and meaning stay.

    \b
    modewright format spec
    modewright format --check spec/plant.yaml
    """
    from language.text.document import read_text
    from modewright.editing.formatter import format_text

    paths = [path for file in files for path in _find_specs(file)]
    made: dict[Path, bytes] = {}
    for path in paths:
        read_text(path)  # refuses what is no text
        before = path.read_bytes()
        data = format_text(before.decode(), str(path)).encode()
        if data != before:
            made[path] = data
    notes = {path: _write_note(path) for path in made}
    if not check:
        for path in made:
            require_writable_location(path)
        write_files(made)
    for path, note in notes.items():
        verb = "would change" if check else "changed"
        console().print(f"{verb} {path}{note}", soft_wrap=True, markup=False)
    console().print(f"{pluralise(len(paths), 'spec')} read, {pluralise(len(made), 'change')}")
    if check and made:
        raise typer.Exit(PROBLEMS)


def _write_note(path: Path) -> str:
    """Return what else comes of writing a file: it is a new one, other hard links keep the old."""
    others = path.stat().st_nlink - 1
    return (
        f" (no longer one file with its {pluralise(others, 'other hard link')})" if others else ""
    )


def _find_specs(path: Path) -> list[Path]:
    return sorted(path.rglob("*.yaml")) if path.is_dir() else [path]
