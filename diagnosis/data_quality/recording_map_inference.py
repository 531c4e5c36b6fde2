"""Recording map inference: what files without a recording map have, from names and units of
columns."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np

from engine.recordings.channel_reader import file_unit
from engine.recordings.recording import open_recording
from engine.recordings.recording_file import RecordedFile
from language.expressions.units import NO_UNIT, PURE_NUMBER, Unit, are_compatible, parse_unit
from language.model.system import ColumnMapping, RecordingMap
from language.overlays.expand_document import display_path
from language.text.diagnostic import Problems, Source, Span
from language.text.document import ScalarNode

TIME_NAME = re.compile(r"(t|time|timestamp|zeit)(_(s|ms|us))?", re.IGNORECASE)
CHANNEL_TIME_NAME = re.compile(r"(t|time)_\w+_(s|ms|us)", re.IGNORECASE)
"""Names of time columns: of the whole file, and of single columns (these are not read)."""
UNIT_SUFFIXES = {
    "nm": "N*m", "rpm": "rpm", "radps": "rad/s", "rad_s": "rad/s", "kmh": "km/h", "m_s": "m/s",
    "mm_s": "mm/s", "mps": "m/s", "kn": "kN", "n": "N", "mm": "mm", "m": "m", "rad": "rad",
    "deg": "deg", "v": "V", "a": "A", "degc": "degC",
}  # fmt: skip
"""Units by the suffixes of column names."""
INPUT_UNITS = ("N*m", "N")
"""Columns with these units are inputs, all others outputs."""
MAX_COLUMNS = 12
"""Maximum number of columns of a guessed map."""
MIN_NUMBER_FRACTION = 0.2
"""Fraction of cells that must be numbers."""


def guess_map(paths: Sequence[Path], databases: Sequence[str] = ()) -> RecordingMap:
    """Return a map of the first `MAX_COLUMNS` (12) numeric columns of all files together.

    The columns of a file follow those of the files before it. The time is the first column of the
    first file that is named like a time (`t`, `time_ms`), else its first strictly increasing one.
    The unit is that of the first file with the column, else that of the suffix of the name
    (`UNIT_SUFFIXES`), else none; columns in units of force or torque are inputs, all others
    outputs. Names that a file has twice are left out. `databases` are the CAN databases of the
    command line. Raises SpecError if the first file has no time column, for a file that cannot be
    opened, and if no file has a numeric column; MissingToolError if the format needs a package that
    is not installed.
    """
    place = Span(Source(display_path(paths[0])), 1, 1)
    found = tuple(ScalarNode(name, Span(Source("command line"), 1, 1)) for name in databases)
    second = parse_unit("s")
    empty = RecordingMap("guessed from the names", "", second, {}, {}, place, databases=found)
    problems = Problems()
    files = [open_recording(path, empty, problems) for path in paths]
    problems.raise_if_errors()
    time = "" if files[0].is_stamped else _find_time_column(files[0], problems)
    problems.raise_if_errors()
    ending = time.rpartition("_")[2].lower()
    unit = parse_unit(ending) if ending in ("ms", "us") else second
    columns: dict[str, ColumnMapping] = {}
    for path, file in zip(paths, files, strict=True):
        span = Span(Source(display_path(path)), 1, 1)
        for name in _numeric_columns(file, time):
            if name not in columns and len(columns) < MAX_COLUMNS:
                columns[name] = _guess_column(name, file.read(name).unit, span)
    if not columns:
        problems.error("empty", files[0].header_span, "the recording has no column of numbers")
    problems.raise_if_errors()
    return replace(empty, time=time, time_unit=unit, columns=columns)


def _numeric_columns(file: RecordedFile, time: str) -> Iterator[str]:
    """Yield the columns of numbers of a file except those of time, in the order of the file.

    Names that the file has twice are left out. Of two names of one signal in a file with time
    stamps the shorter one is kept.
    """
    names = [
        n for n in dict.fromkeys(file.names) if n != time and not CHANNEL_TIME_NAME.fullmatch(n)
    ]
    if file.is_stamped:
        names = [n for n in names if n.rpartition(".")[2] == n or n.rpartition(".")[2] not in names]
    yield from (n for n in names if list(file.names).count(n) == 1 and _is_number(file, n))


def _find_time_column(file: RecordedFile, problems: Problems) -> str:
    """Return the first column with a name of time, else the first increasing one;
    "" with a problem.
    """
    named = [name for name in file.names if TIME_NAME.fullmatch(name)]
    for name in (*named, *file.names):
        if list(file.names).count(name) != 1:
            continue
        values = [v for v in file.read(name).values if v is not None]
        if name in named or (len(values) > 1 and bool(np.all(np.diff(values) > 0.0))):
            return name
    hint = "`--map` says which column is the time"
    problems.error("time", file.header_span, "no column of the recording looks like time", hint)
    return ""


def _is_number(file: RecordedFile, name: str) -> bool:
    """Return whether more than 20 % of the cells of a
    column are finite numbers and few are not finite.
    """
    values = file.read(name).values
    number = sum(value is not None and math.isfinite(value) for value in values)
    bad = sum(value is not None and not math.isfinite(value) for value in values)
    return number > MIN_NUMBER_FRACTION * len(values) and bad <= number // 10


def _guess_column(name: str, written: str, span: Span) -> ColumnMapping:
    """Return the mapping of a column: an input if its unit is one of `INPUT_UNITS`,
    else an output.
    """
    unit = _guess_unit(name, written)
    drives = any(are_compatible(unit.dimension, parse_unit(text).dimension) for text in INPUT_UNITS)
    return ColumnMapping(
        name=name,
        columns=(name,),
        to=name if drives else None,
        compare=None if drives else name,
        unit=unit,
        scale=(Fraction(1), PURE_NUMBER),
        sign=1,
        delay=Fraction(0),
        blank="skip",
        time=None,
        span=span,
    )


def _guess_unit(name: str, written: str) -> Unit:
    """Return the unit from the file, else from the suffix of the name, else no unit."""
    known = file_unit(written) if written else None
    if known is not None:
        return known
    for ending, text in sorted(UNIT_SUFFIXES.items(), key=lambda pair: -len(pair[0])):
        if name.lower().endswith("_" + ending):
            return parse_unit(text)
    return NO_UNIT
