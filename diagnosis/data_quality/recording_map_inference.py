"""Recording map inference: the map of files without one, from names and units of columns."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np

from diagnosis.data_quality.clock_overlap import (
    ONE_CLOCK,
    format_span,
    is_continuous,
    lacking_overlap,
)
from diagnosis.data_quality.finding import Finding, Severity
from diagnosis.data_quality.signal_words import read_unit_suffix
from engine.recordings.can_log import propose_frame_time
from engine.recordings.channel_reader import file_unit
from engine.recordings.recording import open_recording
from engine.recordings.recording_file import RecordedFile, Samples
from engine.recordings.recording_window import strip_window_suffix
from language.expressions.unit_spellings import unit_meanings
from language.expressions.units import (
    NO_UNIT,
    PURE_NUMBER,
    SECOND,
    Unit,
    are_compatible,
    parse_unit,
)
from language.model.system import CanDatabase, ColumnMapping, RecordingMap
from language.overlays.expand_document import display_path
from language.text.diagnostic import Problems, Source, Span, SpecError
from language.text.document import ScalarNode

TIME_NAME = re.compile(
    r"(t|time|timestamp|datetime|zeit|ms_today)(_(s|ms|us|ns)| ?[\[(]\w+[\])])?", re.IGNORECASE
)
CHANNEL_TIME_NAME = re.compile(r"(t|time)_\w+_(s|ms|us)", re.IGNORECASE)
"""Names of time columns: of the whole file, and of single columns (these are not read)."""
INPUT_UNITS = ("N*m", "N")
"""Columns with these units are inputs, all others outputs."""
EPOCH_UNITS = ((1e17, "ns"), (1e14, "us"), (1e11, "ms"))
"""Units of epochs by their smallest stamp."""
MAX_COLUMNS = 12
"""Maximum number of columns of a guessed map."""
MIN_NUMBER_FRACTION = 0.2
"""Fraction of cells that must be numbers."""
NO_VALUE = re.compile(r"[+-]?(nan|inf|infinity)|n/?a|null|none|-", re.IGNORECASE)
"""Texts that loggers write for a value that is missing."""
MAX_SHOWN = 20
"""Number of characters of a text that a finding shows."""


def guess_map(
    names: Mapping[Path, str], databases: Sequence[str] = ()
) -> tuple[RecordingMap, tuple[Finding, ...]]:
    """Return a map of the first `MAX_COLUMNS` (12) numeric columns, and findings on the others.

    `names` are the display names of files, `databases` the CAN databases of the command line
    (`car.dbc`, or `can0=car.dbc` for those of one bus). The
    time is a column of the first file with such a name, else one that increases. Units are those of
    the file, else of the suffix; columns in `INPUT_UNITS` are inputs. Raises SpecError without a
    time or a numeric column and for a file that cannot be opened; MissingToolError for a missing
    package.
    """
    paths = list(names)
    place = Span(Source(display_path(paths[0])), 1, 1)
    found = tuple(map(read_database_option, databases))
    empty = unmapped("guessed from the names", place, found)
    problems = Problems()
    opened = [open_without_map(path, empty, problems) for path in paths]
    files = [file for file, *_ in opened]
    problems.raise_if_errors()
    time, unit, reason = opened[0][1:]
    columns: dict[str, ColumnMapping] = {}
    for path, file in zip(paths, files, strict=True):
        span = Span(Source(display_path(path)), 1, 1)
        for name in _numeric_columns(file, time):
            if name not in columns and len(columns) < MAX_COLUMNS:
                columns[name] = _guess_column(name, file.read(name).unit, span)
    if not columns:
        reason = _first_fault(files[0], time)
        label = "the recording has no column of numbers"
        problems.error("empty", files[0].header_span, label, reason)
    problems.raise_if_errors()
    mapping = replace(empty, time=time, time_unit=unit, columns=columns)
    findings = [
        finding
        for path, file in zip(paths, files, strict=True)
        for finding in _left_out_findings(file, mapping, names[path])
    ]
    if reason:
        text = f"the time `{time}` is taken in {unit.text}: {reason}"
        findings += [Finding("unit", name, time, text, "note") for name in names.values()]
    return mapping, tuple(findings)


def unmapped(name: str, place: Span, databases: tuple[CanDatabase, ...] = ()) -> RecordingMap:
    """Return a map without columns, with which a file is opened before its columns are known."""
    return RecordingMap(name, "", parse_unit("s"), {}, {}, place, databases=databases)


def open_without_map(
    path: Path, empty: RecordingMap, problems: Problems
) -> tuple[RecordedFile, str, Unit, str]:
    """Return an opened file, its time column with the unit, and the reason if it is not stated.

    `empty` is a map without columns (`unmapped`). The time column is empty if the file needs none.
    Raises SpecError for a file that cannot be opened, and if no column looks like time.
    """
    try:
        file = open_recording(path, empty, problems)
    except SpecError as error:
        is_time = error.problems[0].kind == "time"  # the file has been read then
        found = propose_frame_time(strip_window_suffix(path)) if is_time else None
        if found is None:
            raise
        time, unit = found[0], parse_unit(found[1])
        file = open_recording(path, replace(empty, time=time, time_unit=unit), problems)
        return file, time, unit, found[2]
    problems.raise_if_errors()
    return file, *guess_time(file)


def guess_time(file: RecordedFile) -> tuple[str, Unit, str]:
    """Return the column of time, its unit and the reason of the unit if it is not stated.

    The column is empty for a file whose channels have their own time stamps. Raises SpecError if no
    column looks like time.
    """
    if file.is_stamped:
        return "", parse_unit("s"), ""
    problems = Problems()
    time = _find_time_column(file, problems)
    problems.raise_if_errors()
    return time, *_guess_time_unit(file.read(time), time)


def read_database_option(text: str) -> CanDatabase:
    """Return the database of an option `FILE`, or `BUS=FILE`."""
    bus, separator, name = text.partition("=")
    span = Span(Source("command line"), 1, 1)
    if separator and not Path(text).exists():
        return CanDatabase(ScalarNode(name, span), bus)
    return CanDatabase(ScalarNode(text, span))


def _left_out_findings(file: RecordedFile, mapping: RecordingMap, name: str) -> list[Finding]:
    """Return a finding on each column of a file that a guessed map leaves out, and on its clocks.

    The second name of a signal is not reported.
    """
    if not file.rows:
        return []
    found: list[Finding] = []
    candidates = list(_numeric_columns(file, mapping.time))
    own = [n for n in distinct_names(file, mapping.time) if not CHANNEL_TIME_NAME.fullmatch(n)]
    aliases = set(file.names) - set(own) - {mapping.time}
    for column in dict.fromkeys(file.names):
        text = ""
        severity: Severity = "note"
        if file.names.count(column) > 1:
            text, severity = "is in the file twice", "error"
        elif column == mapping.time or column in mapping.columns:
            written = mapping.columns[column].file_unit if column in mapping.columns else ""
            if written:
                text = f"has the unit `{written}`, which is not understood: taken without a unit"
                found.append(Finding("unit", name, column, text, "warning"))
            continue
        elif column in candidates:
            text = f"is not among the first {MAX_COLUMNS} columns"
        elif CHANNEL_TIME_NAME.fullmatch(column):
            found += _clock_findings(file, column, mapping, name)
            text = "looks like the time of other columns"
        elif column not in aliases:
            text, severity = _explain_left_out(file, column)
        if not text:
            continue
        if file.is_stamped and severity == "error":
            severity = "note"  # a database has more signals than a log
        text = text if column else f"a column without a name {text}"
        text += ": left out (--map says which columns are read)"
        found.append(Finding("left_out", name, column, text, severity))
    return found


def _explain_left_out(file: RecordedFile, column: str) -> tuple[str, Severity]:
    """Return why a column is none of numbers, or cannot be read, and how severe that is."""
    try:
        samples = file.read(column)
    except SpecError as error:
        return f"cannot be read ({error.problems[0].label.replace('`', '')})", "warning"
    values = samples.values
    bad = [k for k, value in enumerate(values) if value is not None and not math.isfinite(value)]
    count = sum(value is not None for value in values) - len(bad)
    word = next((text for text in map(samples.text, bad) if not NO_VALUE.fullmatch(text)), "")
    if word:
        return f"has text, such as '{word[:MAX_SHOWN].replace('`', '')}'", "warning"
    if not count:
        word = next(filter(None, map(samples.text, range(len(values)))), "")
        return f"has no number: it is {'all ' + word if word else 'blank'}", "error"
    return f"has numbers in {count} of its {len(values)} cells only", "warning"


def _clock_findings(
    file: RecordedFile, column: str, mapping: RecordingMap, name: str
) -> list[Finding]:
    """Return an error if a time column of channels shares hardly any time with that of the map."""
    if file.names.count(mapping.time) != 1:
        return []
    clocks = {}
    for one in (mapping.time, column):
        ending = one.rpartition("_")[2].lower()
        factor = float(parse_unit(ending).factor) if ending in ("ms", "us") else 1.0
        known = [v for v in file.read(one).values if v is not None and math.isfinite(v)]
        clocks[one] = factor * np.array(known)
    if not all(is_continuous(stamps) for stamps in clocks.values()):
        return []
    first, second = clocks.values()
    amount = lacking_overlap(first, second, is_other_clock=True)
    if not amount:
        return []
    both = " and ".join(f"`{one}` ({format_span(stamps)})" for one, stamps in clocks.items())
    text = f"the times {both} have {amount} in common{ONE_CLOCK}"
    return [Finding("time", name, column, text, "error")]


def _numeric_columns(file: RecordedFile, time: str) -> Iterator[str]:
    """Yield the unique columns of numbers of a file except those of time, in its order."""
    names = distinct_names(file, time)
    names = [n for n in names if not CHANNEL_TIME_NAME.fullmatch(n)]
    yield from (n for n in names if file.names.count(n) == 1 and _is_number(file, n))


def distinct_names(file: RecordedFile, time: str) -> list[str]:
    """Return each name except those of time; the shortest name of a signal that is its own."""
    counts = Counter(file.names)
    names = [n for n in counts if n != time]
    if file.is_stamped:
        parts = {name: name.split(".") for name in names}
        names = [
            name
            for name, words in parts.items()
            if not any(counts[".".join(words[k:])] == 1 for k in range(1, len(words)))
        ]
    return names


def _find_time_column(file: RecordedFile, problems: Problems) -> str:
    """Return the first column named like time, else the first increasing one, else none ("")."""
    named = [name for name in file.names if TIME_NAME.fullmatch(name)]
    for name in (*named, *file.names):
        if file.names.count(name) != 1:
            continue
        values = [v for v in file.read(name).values if v is not None]
        if name in named or (len(values) > 1 and bool(np.all(np.diff(values) > 0.0))):
            return name
    hint = "`--map` says which column is the time"
    problems.error("time", file.header_span, "no column of the recording looks like time", hint)
    return ""


def _guess_time_unit(samples: Samples, name: str) -> tuple[Unit, str]:
    """Return the unit of time, and the reason if it follows neither from the file nor its names.

    It is the unit that the file states, else the one in the name (`t_ms`, `ms_today`), else that of
    an epoch of this century (stamps from 1e11 on are in ms, us or ns), else s.
    """
    for unit in unit_meanings(samples.unit):
        if are_compatible(unit.dimension, SECOND):
            return unit, ""
    words = name.lower().split("_")
    for word in (words[-1], words[0]):
        if word in ("ms", "us", "ns"):
            return parse_unit(word), ""
    first = next((abs(v) for v in samples.values if v is not None and math.isfinite(v)), 0.0)
    epoch = next((text for start, text in EPOCH_UNITS if first >= start), "")
    return parse_unit(epoch or "s"), "its values are epochs of this century" if epoch else ""


def _is_number(file: RecordedFile, name: str) -> bool:
    """Return whether over 20 % of the cells are finite and few are not finite.

    A column that cannot be read is none of numbers.
    """
    try:
        samples = file.read(name)
    except SpecError:
        return False
    values = samples.values
    if samples.words and any(value is not None and math.isnan(value) for value in values):
        return False  # words of the file
    is_finite = [math.isfinite(value) for value in values if value is not None]
    number, bad = is_finite.count(True), is_finite.count(False)
    return number > MIN_NUMBER_FRACTION * len(values) and bad <= number // 10


def _first_fault(file: RecordedFile, time: str) -> str:
    """Return why the first column cannot be read; empty if all can be read."""
    for name in distinct_names(file, time):
        try:
            if file.names.count(name) == 1:
                file.read(name)
        except SpecError as error:
            return error.problems[0].label
    return ""


def _guess_column(name: str, written: str, span: Span) -> ColumnMapping:
    """Return the mapping of a column: an input for `INPUT_UNITS`, else an output.

    A unit of the file that is not understood is accepted as it is.
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
        file_unit="" if unit_meanings(written) else written,
    )


def _guess_unit(name: str, written: str) -> Unit:
    """Return the unit from the file, else from the suffix of the name, else no unit."""
    known = file_unit(written) if written else None
    if known is not None:
        return known
    return next((one.unit for one in read_unit_suffix(name) if one.unit), NO_UNIT)
