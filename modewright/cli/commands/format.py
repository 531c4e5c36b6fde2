"""Command format: format the layout of specs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.common.console import console
from modewright.cli.common.exit_codes import PROBLEMS
from modewright.render.pluralisation import pluralise
from modewright.runtime.output_files import require_writable_location, write_files


def format(
    files: Annotated[list[Path], typer.Argument(help="specs, or folders of specs")],
    check: Annotated[
        bool, typer.Option("--check", help="write nothing; exit with code 1 if a file would change")
    ] = False,
) -> None:
    """Format specs: indentation, blanks, alignment. Comments, quotes and meaning do not change.

    \b
    modewright format spec
    modewright format --check spec/plant.yaml
    """
    from language.text.document import read_text
    from language.text.project_boundary import require_link_inside_project
    from modewright.editing.formatter import format_text

    paths = [path for file in files for path in _find_specs(file)]
    made: dict[Path, bytes] = {}
    for path in paths:
        require_link_inside_project(path, str(path))
        read_text(path)  # raises SpecError for binary files
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
    """Return a note if writing breaks hard links to a file; else an empty text."""
    others = path.stat().st_nlink - 1
    return (
        f" (no longer one file with its {pluralise(others, 'other hard link')})" if others else ""
    )


def _find_specs(path: Path) -> list[Path]:
    """Return the YAML files below a folder in order, or the file itself.

    Raises SpecError for a folder without YAML files.
    """
    found = sorted(path.rglob("*.yaml")) if path.is_dir() else [path]
    if not found:
        from modewright.api.spec_check import no_spec_error

        raise no_spec_error(path)
    return found
