"""Characteristic: a parameter as calibration tools exchange it - texts, each with its place."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from language.text.diagnostic import Problems, Source, Span

NOWHERE = Span(Source(""), 0, 0)
"""The place of what is not read from a file."""
MAX_PROBLEMS = 20
"""After so many problems the rest of a file is not looked at."""


@dataclass(frozen=True)
class Cell:
    """A text of a file and where it stands."""

    text: str
    span: Span = NOWHERE


@dataclass(frozen=True)
class FileAxis:
    """An axis of a table; `unit` is None where none is told."""

    points: tuple[Cell, ...]
    unit: Cell | None = None


@dataclass(frozen=True)
class FileCharacteristic:
    """A parameter with its values; of a table the last axis varies fastest.

    `unit` is None where the file tells none. `is_text`: the values are words, not numbers.
    """

    name: Cell
    values: tuple[Cell, ...]
    unit: Cell | None = None
    axes: tuple[FileAxis, ...] = ()
    is_text: bool = False
    about: str = ""


@dataclass(frozen=True)
class PageFile:
    """What a file of calibration data holds: its source and the characteristics in their order."""

    source: Source
    characteristics: tuple[FileCharacteristic, ...]


def transpose_map(values: Sequence[Cell], columns: int) -> tuple[Cell, ...]:
    """Return the values of a map with its axes exchanged: rows of so many columns, by column."""
    return tuple(cell for column in range(columns) for cell in values[column::columns])


def report_duplicates(characteristics: Iterable[FileCharacteristic], problems: Problems) -> None:
    """Report names that stand twice in a file."""
    first: dict[str, Span] = {}
    for one in characteristics:
        place = first.setdefault(one.name.text, one.name.span)
        if place is not one.name.span:
            label = f"`{one.name.text}` stands here twice"
            problems.error("duplicate", one.name.span, label, f"first at {place}")


def stop_if_many(problems: Problems) -> None:
    """Raise SpecError where a file has so many problems that more would not help."""
    if sum(problem.severity == "error" for problem in problems.reported) >= MAX_PROBLEMS:
        problems.raise_if_errors()
