"""Column guess: a recording map for a file without one, from the names and units of its columns."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
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


def guess_map(path: Path, databases: Sequence[str] = ()) -> RecordingMap:
    """Return a map of the first `MAX_COLUMNS` (12) numeric columns of a file.

    The time is the first column named like a time (`t`, `time_ms`), else the first strictly
    increasing one. The unit is that of the file, else that of the suffix of the name
    (`UNIT_SUFFIXES`), else none; columns in units of force or torque are inputs, all others
    outputs. Repeated names are left out. `databases` are the CAN databases of the command line.
    Raises SpecError if there is no time column or no numeric column, and MissingToolError if the
    format needs a package that is not installed.
    """
    place = Span(Source(display_path(path)), 1, 1)
    found = tuple(ScalarNode(name, Span(Source("command line"), 1, 1)) for name in databases)
    second = parse_unit("s")
    empty = RecordingMap("guessed from the names", "", second, {}, {}, place, databases=found)
    problems = Problems()
    file = open_recording(path, empty, problems)
    problems.raise_if_errors()
    time = "" if file.is_stamped else _find_time_column(file, problems)
    problems.raise_if_errors()
    ending = time.rpartition("_")[2].lower()
    unit = parse_unit(ending) if ending in ("ms", "us") else second
    names = [
        n for n in dict.fromkeys(file.names) if n != time and not CHANNEL_TIME_NAME.fullmatch(n)
    ]
    if file.is_stamped:  # A signal with two names keeps the shorter one.
        names = [n for n in names if n.rpartition(".")[2] == n or n.rpartition(".")[2] not in names]
    kept = [name for name in names if list(file.names).count(name) == 1 and _is_number(file, name)]
    columns = {
        name: _guess_column(name, file.read(name).unit, place) for name in kept[:MAX_COLUMNS]
    }
    if not columns:
        problems.error("empty", file.header_span, "the recording has no column of numbers")
    problems.raise_if_errors()
    return replace(empty, time=time, time_unit=unit, columns=columns)


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
