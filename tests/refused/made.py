"""Made: refused files that are not committed - too large, absent, special - and neighbours."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from language.document import MAX_BYTES, MAX_DEPTH

SPEC = """language: 1
automaton: made
states: {x: {unit: m, initial: 0 m}}
modes: {only: {flow: {x: der(x) = 1 m/s}}}
outputs: [x]
"""
Pair = tuple[Path, Path]


def huge(folder: Path) -> Pair:
    """A file one byte above the limit, and one at it."""
    refused, neighbour = folder / "huge.yaml", folder / "largest.yaml"
    comment = "#" * 99 + "\n"
    text = SPEC + comment * ((MAX_BYTES - len(SPEC)) // len(comment))
    text += "#" * (MAX_BYTES - len(text) - 1) + "\n"
    neighbour.write_text(text)
    refused.write_text(text + "\n")
    return refused, neighbour


def absent(folder: Path) -> Pair:
    """A file that is not there."""
    neighbour = folder / "present.yaml"
    neighbour.write_text(SPEC)
    return folder / "absent.yaml", neighbour


def folder_as_file(folder: Path) -> Pair:
    """A directory where a file is wanted."""
    (folder / "folder.yaml").mkdir()
    return folder / "folder.yaml", absent(folder)[1]


def deep(folder: Path) -> Pair:
    """Brackets nested one level too deeply, and lists as deep as can be, in `about`."""
    refused, neighbour = folder / "deep.yaml", folder / "deepest.yaml"
    for path, levels in ((refused, MAX_DEPTH), (neighbour, MAX_DEPTH - 1)):
        path.write_text(SPEC + f"about: {'[' * levels}text{']' * levels}\n")
    return refused, neighbour


MADE: dict[str, Callable[[Path], Pair]] = {
    "huge": huge,
    "absent": absent,
    "folder": folder_as_file,
    "deep": deep,
}
