"""Characteristics of calibration files: names, values, units and axes as positioned texts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from language.text.diagnostic import Problems, Source, Span

NOWHERE = Span(Source(""), 0, 0)
"""The position of a text that does not come from a file."""
MAX_PROBLEMS = 20
"""Number of errors after which the rest of a file is not read."""


@dataclass(frozen=True)
class Cell:
    """A text of a file and its position."""

    text: str
    span: Span = NOWHERE


@dataclass(frozen=True)
class FileAxis:
    """An axis of a table; `unit` is None if the file gives none."""

    points: tuple[Cell, ...]
    unit: Cell | None = None


@dataclass(frozen=True)
class FileCharacteristic:
    """A parameter in a file with its values; in a table the last axis varies fastest.

    `unit` is None if the file gives none. `is_text` tells that the values are words, not numbers.
    """

    name: Cell
    values: tuple[Cell, ...]
    unit: Cell | None = None
    axes: tuple[FileAxis, ...] = ()
    is_text: bool = False
    about: str = ""


@dataclass(frozen=True)
class PageFile:
    """The contents of a calibration file: its source and its characteristics in their order."""

    source: Source
    characteristics: tuple[FileCharacteristic, ...]


def transpose_map(values: Sequence[Cell], columns: int) -> tuple[Cell, ...]:
    """Return the values of a map column by column.

    `values` are given row by row, with `columns` values in each row.
    """
    return tuple(cell for column in range(columns) for cell in values[column::columns])


def report_duplicates(characteristics: Iterable[FileCharacteristic], problems: Problems) -> None:
    """Report an error at each further occurrence of a name, with the position of the first one."""
    first: dict[str, Span] = {}
    for one in characteristics:
        place = first.setdefault(one.name.text, one.name.span)
        if place is not one.name.span:
            label = f"`{one.name.text}` stands here twice"
            problems.error("duplicate", one.name.span, label, f"first at {place}")


def stop_if_many(problems: Problems) -> None:
    """Raise SpecError if MAX_PROBLEMS errors or more are reported; warnings do not count."""
    if sum(problem.severity == "error" for problem in problems.reported) >= MAX_PROBLEMS:
        problems.raise_if_errors()
