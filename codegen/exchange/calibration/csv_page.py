"""CSV pages: one line for each number, with columns name, value, unit, x, x_unit, y, y_unit.

The columns x and y hold the axis points of tables.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from codegen.exchange.calibration.characteristic import (
    Cell,
    FileAxis,
    FileCharacteristic,
    PageFile,
    stop_if_many,
)
from codegen.exchange.calibration.name_filter import NameFilter
from language.text.diagnostic import Problems, Source, Span, suggest_name

COLUMNS = ("name", "value", "unit", "x", "x_unit", "y", "y_unit")
"""The columns of a page."""
REQUIRED_COLUMNS = ("name", "value")
"""The columns that a file must have."""
SEPARATORS = ",;\t"
"""Separators that are recognised; the most frequent one in the first line is used."""

Row = Mapping[str, Cell]
"""The cells of a line by column."""


@dataclass(frozen=True)
class _ReadContext:
    """The source of a file, its problems and the filter of names."""

    source: Source
    problems: Problems
    name_filter: NameFilter


def format_csv(_title: str, _heading: Sequence[str], page: Sequence[FileCharacteristic]) -> str:
    """Return a page as CSV with the header COLUMNS and one line for each value.

    The separator is a comma. Cells of absent units and axes are empty. The title and the
    heading are ignored, because CSV has no comments.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for one in page:
        writer.writerows(_format_rows(one))
    return text.getvalue()


def _format_rows(characteristic: FileCharacteristic) -> Iterator[tuple[str, ...]]:
    """Yield the cells of one line for each value of a characteristic."""
    unit = characteristic.unit.text if characteristic.unit else ""
    points: list[tuple[str, ...]] = [()]
    for axis in characteristic.axes:
        beside = axis.unit.text if axis.unit else ""
        points = [(*before, point.text, beside) for before in points for point in axis.points]
    for cell, coordinates in zip(characteristic.values, points, strict=True):
        row = (characteristic.name.text, cell.text, unit, *coordinates)
        yield row + ("",) * (len(COLUMNS) - len(row))


def read_csv(source: Source, text: str, problems: Problems, name_filter: NameFilter) -> PageFile:
    """Return the characteristics of a CSV page whose names the filter accepts.

    The separator is the one of SEPARATORS that is most frequent in the first line, which names the
    columns (COLUMNS, in any order and case). The lines of one name must be consecutive and form a
    full grid over x and y, y fastest. Problems are reported to `problems`; SpecError is raised for
    wrong columns, at the end if there are errors, or after MAX_PROBLEMS errors.
    """
    context = _ReadContext(source, problems, name_filter)
    groups: dict[str, list[Row]] = {}
    last = ""
    for row in _read_rows(context, text):
        name = row["name"]
        if name.text in groups and name.text != last:
            label = f"`{name.text}` stands here twice"
            place = groups[name.text][0]["name"].span
            problems.error("duplicate", name.span, label, f"first at {place}")
            stop_if_many(problems)
        groups.setdefault(name.text, []).append(row)
        last = name.text
    problems.raise_if_errors()
    characteristics = [_parse_characteristic(rows, problems) for rows in groups.values()]
    problems.raise_if_errors()
    return PageFile(source, tuple(characteristics))


def _read_rows(context: _ReadContext, text: str) -> Iterator[Row]:
    """Yield the cells of each accepted line by column.

    The first line holds the names of the columns.
    """
    first = context.source.lines[0]
    separator = max(SEPARATORS, key=first.count)
    lines = csv.reader(io.StringIO(text, newline=""), delimiter=separator, strict=True)
    columns: list[str] = []
    try:
        for cells in lines:
            span = Span(context.source, lines.line_num, 1)
            if not columns:
                columns = [cell.strip().lower() for cell in cells]
                _require_columns(columns, span, context.problems)
            elif any(cell.strip() for cell in cells):
                yield from _parse_row(columns, cells, span, context)
    except csv.Error as error:
        span = Span(context.source, max(1, lines.line_num), 1)
        context.problems.error("form", span, f"this is not CSV: {error}")
    stop_if_many(context.problems)


def _require_columns(columns: Sequence[str], span: Span, problems: Problems) -> None:
    """Report missing, unknown and duplicate columns; raises SpecError if there are any."""
    for column in REQUIRED_COLUMNS:
        if column not in columns:
            problems.error("column", span, f"the first line has no column `{column}`")
    for number, column in enumerate(columns):
        if column not in COLUMNS:
            hint = suggest_name(column, COLUMNS) or f"known: {', '.join(COLUMNS)}"
            problems.error("column", span, f"`{column}` is not a column of a page", hint)
        elif column in columns[:number]:
            problems.error("column", span, f"the column `{column}` stands here twice")
    problems.raise_if_errors()


def _parse_row(
    columns: Sequence[str], cells: Sequence[str], span: Span, context: _ReadContext
) -> Iterator[Row]:
    """Yield the row of a line.

    Yields nothing for a name that the filter rejects, and nothing, with a problem reported, for a
    line without a name or with a wrong number of cells.
    """
    texts, problems = [cell.strip() for cell in cells], context.problems
    place = columns.index("name")
    name = texts[place] if place < len(texts) else ""
    if name and not context.name_filter.accepts(Cell(name, span)):
        return
    if len(texts) != len(columns):
        label = f"this line has {len(texts)} cells, the first one has {len(columns)}"
        problems.error("row", span, label)
    elif not name:
        problems.error("missing", span, "this line has no name")
    else:
        at = span.source.lines[span.line - 1] if span.line <= len(span.source.lines) else ""
        yield {
            column: Cell(text, _cell_span(span, at, text))
            for column, text in zip(columns, texts, strict=True)
        }
    stop_if_many(problems)


def _cell_span(span: Span, line: str, text: str) -> Span:
    """Return the position of the first occurrence of a text in a line.

    The begin if it is absent.
    """
    start = max(line.find(text), 0) if text else 0
    return span.subspan(start, len(text))


def _parse_characteristic(rows: Sequence[Row], problems: Problems) -> FileCharacteristic:
    """Return the rows of one name as a characteristic.

    Reports several rows without axis points, points that are not a full grid, and different units.
    """
    first = rows[0]
    axes: list[FileAxis] = []
    for letter in "xy":
        if letter in first and first[letter].text:
            points = {row[letter].text: row[letter] for row in rows}
            unit = first.get(f"{letter}_unit")
            axes.append(FileAxis(tuple(points.values()), unit if unit and unit.text else None))
    if not axes and len(rows) > 1:
        label = f"`{first['name'].text}` stands here twice"
        place = f"first at {first['name'].span}"
        problems.error("duplicate", rows[1]["name"].span, label, place)
    elif axes and not _is_grid(rows, axes):
        label = f"the lines of `{first['name'].text}` are no whole table over x and y"
        problems.error("table", rows[-1]["name"].span, label)
    _require_one_unit(rows, problems)
    unit = first.get("unit")
    values = tuple(row["value"] for row in rows)
    return FileCharacteristic(
        first["name"], values, unit if unit and unit.text else None, tuple(axes)
    )


def _require_one_unit(rows: Sequence[Row], problems: Problems) -> None:
    """Report a unit that differs from that of the first row, one error for each column."""
    first = rows[0]
    for column in (column for column in ("unit", "x_unit", "y_unit") if column in first):
        others = (row[column] for row in rows if row[column].text != first[column].text)
        other = next(others, None)
        if other:
            label = (
                f"`{other.text}` is not `{first[column].text}`, as on the first line of this table"
            )
            problems.error("form", other.span, label, "a table is in one unit")


def _is_grid(rows: Sequence[Row], axes: Sequence[FileAxis]) -> bool:
    """Tell whether the rows are the full grid of the axes, with the last axis fastest."""
    if math.prod(len(axis.points) for axis in axes) != len(rows):
        return False
    grid: list[tuple[str, ...]] = [()]
    for axis in axes:
        grid = [(*before, point.text) for before in grid for point in axis.points]
    given = [tuple(row[letter].text for letter in "xy"[: len(axes)]) for row in rows]
    return given == grid
