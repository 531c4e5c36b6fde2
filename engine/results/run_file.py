"""Run file: stores a trajectory as CSV with a side file, or as Parquet, without loss.

A CSV has only the samples, so other tools can read it. `run.csv.json` beside `run.csv` has mode
names, events and the reason for which the run stopped. Parquet has both in one file. NaN payloads
are not kept.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from engine.results.pyarrow_import import import_pyarrow
from engine.results.sampled_run import Event, SignalArray
from engine.results.trajectory import TIME_HEADER, Trajectory, column_headers
from language.overlays.expand_document import display_path
from language.text.diagnostic import Problems, Source, Span, SpecError

FORMATS = (".csv", ".parquet")
"""Suffixes of run files."""
FORMAT_VERSION = 1
"""Version of the side data; files of another version are refused."""
SideData = dict[str, Any]
"""Content of the side file: names, columns, modes, events, stop reason and faults."""


def encode_run(trajectory: Trajectory, path: Path) -> dict[Path, bytes]:
    """Return the files of a trajectory as bytes by path; nothing is written.

    For `.csv` they are the CSV and its side file (`side_path`), for `.parquet` one file. Raises
    ValueError for another suffix (the case is ignored), and MissingToolError without pyarrow.
    """
    if path.suffix.lower() == ".parquet":
        return {path: _encode_parquet(trajectory)}
    if path.suffix.lower() != ".csv":
        raise ValueError(f"{path}: a run is written to {' or '.join(FORMATS)}")
    side = json.dumps(_side_data(trajectory), indent=1, allow_nan=False) + "\n"
    return {path: trajectory.csv().encode(), side_path(path): side.encode()}


def read_run(path: Path) -> Trajectory:
    """Read a trajectory that `encode_run` wrote, from Parquet or, for any other suffix, from CSV.

    A CSV without side file has no events, no mode names and the name of the file; columns without a
    point or exponent are integers. Raises SpecError for a file that cannot be read, is no run, is
    damaged or does not fit its side file, and MissingToolError without pyarrow.
    """
    if path.suffix.lower() == ".parquet":
        return _read_parquet(path)
    names, units, signals = _read_csv(path)
    beside = side_path(path)
    return _build_trajectory(
        path, names, units, signals, _read_side(beside) if beside.exists() else {}
    )


def side_path(path: Path) -> Path:
    """Return the path of the side file of a CSV: its name with `.json` appended."""
    return path.with_name(path.name + ".json")


def _side_data(trajectory: Trajectory) -> SideData:
    """Return the side data of a trajectory."""
    return {
        "modewright": FORMAT_VERSION,
        "name": trajectory.name,
        "columns": column_headers(trajectory),
        "whole": [name for name, v in trajectory.signals.items() if v.dtype == np.int64],
        "modes": {
            signal: {str(number): name for number, name in names.items()}
            for signal, names in trajectory.modes.items()
        },
        "events": [asdict(event) for event in trajectory.events],
        "stopped": trajectory.stopped,
        "faults": list(trajectory.faults),
    }


def _build_trajectory(
    path: Path,
    names: Sequence[str],
    units: Sequence[str],
    columns: Sequence[SignalArray],
    side: SideData,
) -> Trajectory:
    """Return the trajectory of columns and side data; the first column is the time.

    Raises SpecError if the side data belong to other columns or are damaged.
    """
    headers = [f"{name} [{unit}]" for name, unit in zip(names, units, strict=True)]
    if side and side.get("columns") != headers:
        label = f"{side_path(path).name} belongs to another run: its columns are not those here"
        raise _read_error(path, "column", label, "remove it, or write both anew")
    whole = side.get("whole", ())
    try:
        return Trajectory(
            name=str(side.get("name", path.stem)),
            times=columns[0].astype(np.float64),
            signals={
                name: values.astype(np.int64) if name in whole else values
                for name, values in zip(names[1:], columns[1:], strict=True)
            },
            units=dict(zip(names[1:], units[1:], strict=True)),
            modes=_mode_names(side.get("modes", {})),
            events=tuple(Event(**event) for event in side.get("events", ())),
            stopped=side.get("stopped"),
            faults=tuple(side.get("faults", ())),
        )
    except (TypeError, ValueError, AttributeError) as error:
        raise _read_error(
            path, "form", f"the data beside the samples are damaged: {error}"
        ) from None


def _mode_names(modes: Mapping[str, Mapping[str, str]]) -> dict[str, dict[int, str]]:
    """Return mode names with the numbers as integers; JSON keys are texts."""
    return {
        signal: {int(number): name for number, name in names.items()}
        for signal, names in modes.items()
    }


def _read_side(path: Path) -> SideData:
    """Read a side file. Raises SpecError if it is unreadable or of another version."""
    try:
        side = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise _read_error(path, "form", f"this side file cannot be read: {error}") from None
    if not isinstance(side, dict) or side.get("modewright") != FORMAT_VERSION:
        raise _read_error(path, "version", "this side file is not of a form that is known here")
    return side


def _read_csv(path: Path) -> tuple[list[str], list[str], list[SignalArray]]:
    """Return the names, units and arrays of the columns of a CSV. Raises SpecError."""
    try:
        rows = list(csv.reader(io.StringIO(path.read_text("utf-8")), strict=True))
    except OSError as error:
        raise _read_error(path, "unreadable", f"the run cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise _read_error(path, "form", f"this is not CSV: {error}") from None
    if not rows or rows[0][:1] != [TIME_HEADER]:
        help = "a recording is read by `modewright replay` with a map"
        raise _read_error(
            path, "form", f"this is not a run: its first column is not `{TIME_HEADER}`", help
        )
    for number, row in enumerate(rows[1:], 2):
        if len(row) != len(rows[0]):
            label = f"this row has {len(row)} cells, the head has {len(rows[0])}"
            raise _read_error(path, "row", label, line=number)
    names, units = _names_and_units(path, rows[0])
    return names, units, [_parse_column(path, rows, k) for k in range(len(names))]


def _names_and_units(path: Path, heads: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the names and units of headers `name [unit]`. Raises SpecError for other headers."""
    parts = [head.removesuffix("]").rpartition(" [") for head in heads]
    for head, (name, _, _) in zip(heads, parts, strict=True):
        if not name or not head.endswith("]") or heads.count(head) > 1:
            raise _read_error(path, "column", f"`{head}` is not `name [unit]`, or is there twice")
    return [name for name, _, _ in parts], [unit for _, _, unit in parts]


def _parse_column(path: Path, rows: Sequence[Sequence[str]], position: int) -> SignalArray:
    """Return a column: integers if no cell has a point, an exponent or a word, else reals.

    The time column is always real. Raises SpecError for a cell that is not a number.
    """
    cells = [row[position] for row in rows[1:]]
    if position > 0 and cells and all(cell.removeprefix("-").isdecimal() for cell in cells):
        with suppress(OverflowError):
            return np.array([int(cell) for cell in cells], dtype=np.int64)
    values = np.empty(len(cells), dtype=np.float64)
    for k, cell in enumerate(cells):
        try:
            values[k] = float(cell)
        except ValueError:
            label = f"`{cell}` in column `{rows[0][position]}` is not a number"
            raise _read_error(path, "value", label, line=k + 2) from None
    return values


def _encode_parquet(trajectory: Trajectory) -> bytes:
    """Return a trajectory as the bytes of a Parquet file, with the side data as metadata."""
    arrow = import_pyarrow("Parquet", "; or write .csv")
    columns = [trajectory.times, *trajectory.signals.values()]
    metadata = {b"modewright": json.dumps(_side_data(trajectory), allow_nan=False).encode()}
    table = arrow.table(
        dict(zip(column_headers(trajectory), columns, strict=True)), metadata=metadata
    )
    sink = arrow.BufferOutputStream()
    arrow.parquet.write_table(table, sink)
    data: bytes = sink.getvalue().to_pybytes()
    return data


def _read_parquet(path: Path) -> Trajectory:
    """Read a trajectory from Parquet. Raises SpecError, MissingToolError."""
    arrow = import_pyarrow("Parquet", "; or write .csv")
    try:
        table = arrow.parquet.read_table(path)
        side = json.loads((table.schema.metadata or {}).get(b"modewright", b"{}"))
    except OSError as error:
        label = f"the run cannot be read: {error.strerror or error}"
        raise _read_error(path, "unreadable", label) from None
    except (ValueError, arrow.ArrowException) as error:
        raise _read_error(path, "form", f"this is not Parquet: {error}") from None
    if table.column_names[:1] != [TIME_HEADER] or side.get("modewright") != FORMAT_VERSION:
        raise _read_error(path, "form", "this Parquet file was not written by modewright")
    names, units = _names_and_units(path, table.column_names)
    columns = [column.to_numpy() for column in table.columns]
    return _build_trajectory(path, names, units, columns, side)


def _read_error(path: Path, kind: str, label: str, help: str = "", line: int = 1) -> SpecError:
    """Return the error of a run file at a line."""
    problems = Problems()
    problems.error(kind, Span(Source(display_path(path)), line, 1), label, help)
    return SpecError(problems.reported)
