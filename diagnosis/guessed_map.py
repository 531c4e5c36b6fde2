"""Guessed map: what a file without a map seems to hold, by the names of its columns."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np

from engine.channel_reader import file_unit
from engine.recorded_file import RecordedFile
from engine.recording import open_recorded
from language.document import Scalar
from language.experiment import Column, RecordingMap
from language.problem import Problems, Source, Span
from language.project import shown
from language.units import NO_UNIT, NUMBER, Unit, fits, parse_unit

TIME = re.compile(r"(t|time|timestamp|zeit)(_(s|ms|us))?", re.IGNORECASE)
TIMES = re.compile(r"(t|time)_\w+_(s|ms|us)", re.IGNORECASE)
"""Columns of time: of all, or of some columns (these are not looked at)."""
ENDINGS = {
    "nm": "N*m", "rpm": "rpm", "radps": "rad/s", "rad_s": "rad/s", "kmh": "km/h", "m_s": "m/s",
    "mm_s": "mm/s", "mps": "m/s", "kn": "kN", "n": "N", "mm": "mm", "m": "m", "rad": "rad",
    "deg": "deg", "v": "V", "a": "A", "degc": "degC",
}  # fmt: skip
"""Units by the endings of names."""
DRIVING = ("N*m", "N")
"""What has one of these units is taken for an input, everything else for an output."""
MOST = 12
"""Most columns that are looked at without a map."""
ENOUGH = 0.2
"""Share of cells that have to be numbers."""


def guessed_map(path: Path, databases: Sequence[str] = ()) -> RecordingMap:
    """Return a map of all columns of numbers. Raises SpecError, ToolMissing."""
    place = Span(Source(shown(path)), 1, 1)
    found = tuple(Scalar(name, Span(Source("command line"), 1, 1)) for name in databases)
    second = parse_unit("s")
    empty = RecordingMap("guessed from the names", "", second, {}, {}, place, databases=found)
    problems = Problems()
    file = open_recorded(path, empty, problems)
    problems.stop_if_any()
    time = "" if file.is_stamped else _time(file, problems)
    problems.stop_if_any()
    ending = time.rpartition("_")[2].lower()
    unit = parse_unit(ending) if ending in ("ms", "us") else second
    names = [n for n in dict.fromkeys(file.names) if n != time and not TIMES.fullmatch(n)]
    if file.is_stamped:  # of a signal that goes by two names the longer one is left out
        names = [n for n in names if n.rpartition(".")[2] == n or n.rpartition(".")[2] not in names]
    kept = [name for name in names if list(file.names).count(name) == 1 and _is_number(file, name)]
    columns = {name: _column(name, file.read(name).unit, place) for name in kept[:MOST]}
    if not columns:
        problems.error("empty", file.head, "the recording has no column of numbers")
    problems.stop_if_any()
    return replace(empty, time=time, time_unit=unit, columns=columns)


def _time(file: RecordedFile, problems: Problems) -> str:
    named = [name for name in file.names if TIME.fullmatch(name)]
    for name in (*named, *file.names):
        if list(file.names).count(name) != 1:
            continue
        values = [v for v in file.read(name).values if v is not None]
        if name in named or (len(values) > 1 and bool(np.all(np.diff(values) > 0.0))):
            return name
    hint = "`--map` says which column is the time"
    problems.error("time", file.head, "no column of the recording looks like time", hint)
    return ""


def _is_number(file: RecordedFile, name: str) -> bool:
    values = file.read(name).values
    number = sum(value is not None and math.isfinite(value) for value in values)
    bad = sum(value is not None and not math.isfinite(value) for value in values)
    return number > ENOUGH * len(values) and bad <= number // 10


def _column(name: str, written: str, place: Span) -> Column:
    unit = _unit(name, written)
    drives = any(fits(unit.dimension, parse_unit(text).dimension) for text in DRIVING)
    return Column(
        name=name,
        columns=(name,),
        to=name if drives else None,
        compare=None if drives else name,
        unit=unit,
        scale=(Fraction(1), NUMBER),
        sign=1,
        delay=Fraction(0),
        blank="skip",
        time=None,
        span=place,
    )


def _unit(name: str, written: str) -> Unit:
    known = file_unit(written) if written else None
    if known is not None:
        return known
    for ending, text in sorted(ENDINGS.items(), key=lambda pair: -len(pair[0])):
        if name.lower().endswith("_" + ending):
            return parse_unit(text)
    return NO_UNIT
