"""Run file: stores a trajectory as CSV with a side file, or as Parquet, without loss, or as MF4.

A CSV has only the samples, so other tools can read it. `run.csv.json` beside `run.csv` has mode
names, events and the reason for which the run stopped. Parquet has both in one file. NaN payloads
are not kept.
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from engine.results.pyarrow_import import import_pyarrow
from engine.results.sampled_run import Event, SignalArray
from engine.results.trajectory import TIME_HEADER, Trajectory, column_headers
from language.overlays.expand_document import display_path
from language.text.diagnostic import Problem, Source, Span, SpecError
from language.text.regular_file import open_regular_file

FORMATS = (".csv", ".parquet")
"""Suffixes of run files that are read."""
WRITTEN_FORMATS = (*FORMATS, ".mf4")
"""Suffixes of run files that are written."""
FORMAT_VERSION = 1
"""Version of the side data; files of another version are refused."""
MODE_NUMBER = re.compile(r"-?[0-9]{1,9}")
"""Number of a mode as a key of JSON."""
INT64_END = 2.0**63
"""The first real number above those of int64."""
SideData = dict[str, Any]
"""Content of the side file: names, columns, modes, events, stop reason and faults."""


def encode_run(trajectory: Trajectory, path: Path) -> dict[Path, bytes]:
    """Return the files of a trajectory as bytes by path; nothing is written.

    For `.csv` they are the CSV and its side file (`side_path`), for `.parquet` and `.mf4` one file.
    An MF4 has no events and is not read back as a run (`encode_mdf`). Raises ValueError for another
    suffix (the case is ignored), and MissingToolError without pyarrow or asammdf.
    """
    if path.suffix.lower() == ".mf4":
        from engine.results.mdf_run import encode_mdf

        return {path: encode_mdf(trajectory)}
    if path.suffix.lower() == ".parquet":
        return {path: _encode_parquet(trajectory)}
    if path.suffix.lower() != ".csv":
        raise ValueError(f"{path}: a run is written to {', '.join(WRITTEN_FORMATS)}")
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
    names, units, columns = _read_csv(path)
    _require_ascending(path, columns[0], first_line=2)
    beside = side_path(path)
    side = _read_side(beside) if beside.exists() else {}
    return _build_trajectory(path, names, units, columns, side, beside)


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
        "piecewise_constant": sorted(trajectory.piecewise_constant),
        "fault_instants": dict(trajectory.fault_instants),
    }


def _build_trajectory(
    path: Path,
    names: Sequence[str],
    units: Sequence[str],
    columns: Sequence[SignalArray],
    side: SideData,
    side_file: Path,
) -> Trajectory:
    """Return the trajectory of columns and side data; the first column is the time.

    `side_file` is the file of the side data. Raises SpecError if the side data belong to other
    columns or are damaged.
    """
    headers = [f"{name} [{unit}]" for name, unit in zip(names, units, strict=True)]
    if side and side.get("columns") != headers:
        label = f"{side_path(path).name} belongs to another run: its columns are not those here"
        raise _read_error(path, "column", label, "remove it, or write both anew")
    fault = _fault_of(side, dict(zip(names[1:], columns[1:], strict=True)))
    if fault:
        raise _read_error(side_file, "form", f"the data beside the samples are damaged: {fault}")
    whole = side.get("whole", ())
    return Trajectory(
        name=side.get("name", path.stem),
        times=columns[0].astype(np.float64),
        signals={
            name: values.astype(np.int64) if name in whole else values
            for name, values in zip(names[1:], columns[1:], strict=True)
        },
        units=dict(zip(names[1:], units[1:], strict=True)),
        modes={
            signal: {int(number): name for number, name in names.items()}
            for signal, names in side.get("modes", {}).items()
        },
        events=tuple(Event(**event) for event in side.get("events", ())),
        stopped=side.get("stopped"),
        faults=tuple(side.get("faults", ())),
        piecewise_constant=frozenset(side.get("piecewise_constant", ())),
        fault_instants=side.get("fault_instants", {}),
    )


def _fault_of(side: SideData, columns: Mapping[str, SignalArray]) -> str:
    """Return what is wrong in side data, with its key; "" if nothing is.

    `columns` are the samples by signal. A signal in `whole` or with mode names has whole numbers.
    """
    if not isinstance(side.get("name", ""), str):
        return "`name` is not a text"
    for key in ("whole", "faults", "piecewise_constant"):
        if not _is_list_of_texts(side.get(key, [])):
            return f"`{key}` is not a list of texts"
    if not isinstance(side.get("stopped"), str | None):
        return "`stopped` is neither a text nor null"
    instants = side.get("fault_instants", {})
    if not isinstance(instants, dict) or not _is_list_of_texts([*instants.values()]):
        return "`fault_instants` is not a mapping of texts"
    modes, events = side.get("modes", {}), side.get("events", [])
    if not isinstance(modes, dict):
        return "`modes` is not a mapping"
    for signal, names in modes.items():
        if not isinstance(names, dict) or not all(
            MODE_NUMBER.fullmatch(number) and isinstance(name, str)
            for number, name in names.items()
        ):
            return f"`modes.{signal}` is not a mapping of whole numbers to texts"
    for signal in (*side.get("whole", []), *modes):
        if signal in columns and not _is_whole(columns[signal]):
            return f"`{signal}` has samples that are not whole numbers"
    if not isinstance(events, list):
        return "`events` is not a list"
    for k, event in enumerate(events):
        fault = _fault_of_event(event)
        if fault:
            return f"`events[{k}]` {fault}"
    return ""


def _fault_of_event(event: object) -> str:
    """Return what is wrong with an event of side data; "" if nothing is."""
    if not isinstance(event, dict):
        return "is not a mapping"
    known = {field.name: field for field in fields(Event)}
    for key, value in event.items():
        if key not in known:
            return f"has an unknown key `{key}`"
        if key == "time":
            if isinstance(value, bool) or not isinstance(value, int | float):
                return "has a `time` that is not a number"
        elif key == "micro_step":
            if isinstance(value, bool) or not isinstance(value, int):
                return "has a `micro_step` that is not a whole number"
        elif not isinstance(value, str):
            return f"has a `{key}` that is not a text"
    missing = [key for key, field in known.items() if field.default is MISSING and key not in event]
    return f"has no `{missing[0]}`" if missing else ""


def _is_list_of_texts(value: object) -> bool:
    """Return whether a value is a list of texts."""
    return isinstance(value, list) and all(isinstance(item, str) for item in value)


def _is_whole(values: SignalArray) -> bool:
    """Return whether samples (n_samples,) are integers of 64 bits."""
    if values.dtype == np.int64:
        return True
    return bool(np.all((np.abs(values) < INT64_END) & (values == np.trunc(values))))


def _require_ascending(path: Path, times: SignalArray, first_line: int) -> None:
    """Raise SpecError if a time is not finite or is before the time of the row above.

    `times` has the shape (n_samples,) [s]; `first_line` is the line of its first value.
    """
    for row in np.flatnonzero(~np.isfinite(times))[:1]:
        label = f"the time `{times[row]}` is not finite"
        raise _read_error(path, "value", label, line=first_line + int(row))
    for row in np.flatnonzero(np.diff(times) < 0.0)[:1] + 1:
        label = f"the time {times[row]} s is before that of the row above, {times[row - 1]} s"
        raise _read_error(path, "order", label, line=first_line + int(row))


def _parse_side(text: str | bytes, path: Path) -> Any:
    """Return the value of a JSON text, without NaN and infinite numbers.

    Raises SpecError, placed in the file `path`, for damaged and for too deeply nested data.
    """
    try:
        return json.loads(text, parse_constant=_refuse_number, parse_float=_parse_finite)
    except ValueError as error:
        raise _read_error(path, "form", f"this side file cannot be read: {error}") from None
    except RecursionError:
        raise _read_error(path, "depth", "this side file is nested too deeply") from None


def _parse_finite(text: str) -> float:
    """Return the number of a text. Raises ValueError if it is not finite."""
    value = float(text)
    return value if math.isfinite(value) else _refuse_number(text)


def _refuse_number(text: str) -> float:
    """Raise ValueError for a number that is not finite."""
    raise ValueError(f"`{text}` is not a finite number")


def _read_side(path: Path) -> SideData:
    """Read a side file. Raises SpecError if it is unreadable or of another version."""
    try:
        text = _read_text(path)
    except OSError as error:
        label = f"this side file cannot be read: {error.strerror or error}"
        raise _read_error(path, "unreadable", label) from None
    except UnicodeDecodeError as error:
        raise _read_error(path, "form", f"this side file cannot be read: {error}") from None
    side = _parse_side(text, path)
    if not isinstance(side, dict) or side.get("modewright") != FORMAT_VERSION:
        raise _read_error(path, "version", "this side file is not of a form that is known here")
    return side


def _read_csv(path: Path) -> tuple[list[str], list[str], list[SignalArray]]:
    """Return the names, units and arrays of the columns of a CSV. Raises SpecError."""
    try:
        rows = list(csv.reader(io.StringIO(_read_text(path)), strict=True))
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


def _read_text(path: Path) -> str:
    """Return the text of a UTF-8 file. Raises OSError and UnicodeDecodeError."""
    with io.TextIOWrapper(open_regular_file(path), "utf-8") as file:
        return file.read()


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
        with open_regular_file(path) as file:
            table = arrow.parquet.read_table(file)
    except OSError as error:
        label = f"the run cannot be read: {error.strerror or error}"
        raise _read_error(path, "unreadable", label) from None
    except (ValueError, arrow.ArrowException) as error:
        raise _read_error(path, "form", f"this is not Parquet: {error}") from None
    side = _parse_side((table.schema.metadata or {}).get(b"modewright", b"{}"), path)
    is_side = isinstance(side, dict) and side.get("modewright") == FORMAT_VERSION
    if table.column_names[:1] != [TIME_HEADER] or not is_side:
        raise _read_error(path, "form", "this Parquet file was not written by modewright")
    names, units = _names_and_units(path, table.column_names)
    columns = [column.to_numpy() for column in table.columns]
    for head, values in zip(table.column_names, columns, strict=True):
        if values.dtype not in (np.float64, np.int64):
            raise _read_error(path, "value", f"column `{head}` has values that are not numbers")
    _require_ascending(path, columns[0], first_line=1)
    return _build_trajectory(path, names, units, columns, side, path)


def _read_error(path: Path, kind: str, label: str, help: str = "", line: int = 1) -> SpecError:
    """Return the error of a run file at a line."""
    return SpecError([Problem(kind, Span(Source(display_path(path)), line, 1), label, help)])
