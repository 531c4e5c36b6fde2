"""File columns: the columns of a recording that can be signals, with what their names say."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from diagnosis.data_quality.recording_map_inference import CHANNEL_TIME_NAME, distinct_names
from diagnosis.data_quality.signal_words import UnitReading, read_unit_suffix, side_of
from engine.recordings.mdf_reader import CAN_CHANNELS
from engine.recordings.recording_file import RecordedFile
from language.expressions.unit_spellings import unit_meanings
from language.text.diagnostic import SpecError

MAX_WORDS = 32
"""Largest number of different words of a column that can be an enumeration."""

MEAN_TOLERANCE = 0.05
"""Largest RMS difference of sensors of one quantity, relative to the span of their values."""


@dataclass(frozen=True)
class FileColumn:
    """One or several columns of a file that are read as one signal, with their own time column.

    `values` has the shape (n_samples,), NaN where a cell has no number. `written` is the unit that
    the file states, `readings` are those of its name. `texts` are its words.
    """

    names: tuple[str, ...]
    written: str
    readings: tuple[UnitReading, ...]
    values: NDArray[np.float64]
    has_blanks: bool
    texts: frozenset[str] = frozenset()
    time: str = ""


def read_file_columns(file: RecordedFile, time: str) -> list[FileColumn]:
    """Return the columns of numbers or words of a file, and the means of redundant ones.

    A signal with several names has its shortest one.
    """
    columns = []
    names = [n for n in distinct_names(file, "") if list(file.names).count(n) == 1]
    clocks = {}
    for name in names:
        if name == time or (file.is_stamped and name.startswith(CAN_CHANNELS)):
            continue
        if CHANNEL_TIME_NAME.fullmatch(name) and not file.is_stamped:
            clocks[name] = _to_array(file.read(name).values)
            continue
        column = _read_column(file, name)
        if column is not None:
            columns.append(column)
    columns += list(_means(columns))
    return [_with_clock(column, clocks) for column in columns]


def _to_array(values: Sequence[float | None]) -> NDArray[np.float64]:
    """Return values (n_samples,) with NaN for None."""
    return np.array([math.nan if value is None else value for value in values])


def _read_column(file: RecordedFile, name: str) -> FileColumn | None:
    """Return a column; None if it has neither numbers nor a few different words."""
    try:
        samples = file.read(name)
    except SpecError:
        return None
    values = _to_array(samples.values)
    blanks = any(value is None for value in samples.values)
    texts = set(samples.words) if samples.words else set()
    if not np.isfinite(values).any() or samples.words:
        cells = (samples.text(k) for k, v in enumerate(samples.values) if v is not None)
        texts |= {text for text in cells if text}
        if len(texts) > MAX_WORDS:
            return None
    if not np.isfinite(values).any() and not texts:
        return None
    readings = read_unit_suffix(name)
    written = samples.unit.strip()
    if written:
        meanings = unit_meanings(written)[:1]
        stem = next((r.stem for r in readings if r.unit in meanings), readings[-1].stem)
        readings = tuple(UnitReading(stem, unit) for unit in meanings) or readings[-1:]
    return FileColumn((name,), written, readings, values, blanks, frozenset(texts))


def _means(columns: Sequence[FileColumn]) -> Iterator[FileColumn]:
    """Yield the mean of columns whose names differ in a side only and whose values agree.

    Columns of two messages, buses or groups are no sensors of one quantity.
    """
    keyed = [(column.names[0].rpartition(".")[0], *side_of(column.names[0])) for column in columns]
    sided = sorted(((group, words), k) for k, (group, words, side) in enumerate(keyed) if side)
    for _, items in groupby(sided, key=lambda item: item[0]):
        group = [columns[k] for _, k in items]
        first = group[0]
        if len(group) < 2 or any(one.written != first.written for one in group):
            continue
        if all(_agree(first.values, one.values) for one in group[1:]):
            names = tuple(name for one in group for name in one.names)
            blanks = any(one.has_blanks for one in group)
            values = np.mean([one.values for one in group], axis=0)
            yield replace(first, names=names, values=values, has_blanks=blanks)


def _agree(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Return whether two columns (n_samples,) have their values together, and nearly equal ones."""
    known = np.isfinite(a)
    if len(a) != len(b) or not np.array_equal(known, np.isfinite(b)) or not known.any():
        return False
    span = float(np.ptp(a[known]))
    return bool(np.sqrt(np.mean((a[known] - b[known]) ** 2)) <= MEAN_TOLERANCE * span)


def _with_clock(column: FileColumn, clocks: dict[str, NDArray[np.float64]]) -> FileColumn:
    """Return a column with the time column that is blank where it is blank, and shares a word."""
    words = set(side_of(column.names[0])[0])
    for name, stamps in clocks.items():
        shared = words & set(side_of(name)[0][1:])
        if shared and np.array_equal(np.isfinite(stamps), np.isfinite(column.values)):
            return replace(column, time=name)
    return column
