"""Reading of a public file by the product, with a comparison of values where there is an oracle.

The result of `read_file` is a text: `read`, the reason of the refusal, or `differs: ...`.
"""

from __future__ import annotations

import json
import math
import random
import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import can
import cantools

from diagnosis.data_quality.recording_map_inference import guess_map
from engine.recordings.can_database import DATABASE_SUFFIXES, read_databases
from engine.recordings.can_log import LOG_SUFFIXES, holds_frames, read_can_log
from engine.recordings.recording import open_recording
from engine.recordings.recording_file import RecordedFile
from language.expressions.units import parse_unit
from language.model.system import CanDatabase, RecordingMap
from language.text.diagnostic import Problems, Source, Span, SpecError
from language.text.document import ScalarNode
from tests.public.dbc_oracle import OracleMessage, OracleSignal, read_dbc

MDF_SUFFIXES = (".mf4", ".mdf")
"""Suffixes of MDF files."""
CAN_BYTES, CAN_FD_BYTES = 8, 64
"""Largest sizes of a frame of CAN and of CAN FD [bytes]."""
MAX_IDENTIFIER = {False: 0x7FF, True: 0x1FFFFFFF}
"""Largest identifiers of a standard and of an extended frame."""
FRAMES = 4
"""Number of random frames of a message, and half of those that select a multiplexed signal."""
MAX_SIGNALS = 3
"""Number of messages of a log that are decoded."""
MAX_CHANNELS = 6
"""Number of channels of an MDF file that are read."""
TOLERANCE = 1e-9
"""Relative difference of values: rounding of a factor and an offset."""
MAX_REASON = 110
"""Number of characters of a reason that are compared."""
DATABASE = """\
VERSION ""
NS_ :
BS_:
BU_: X
"""
"""Head of a database for the frames of a log."""


@dataclass(frozen=True)
class Outcome:
    """What became of a file: `read`, the reason of its refusal, or the first difference.

    `compared` is the number of signals or channels whose values equal those of an oracle.
    """

    text: str
    compared: int = 0


def read_file(path: Path, mdf_python: str = "") -> Outcome:
    """Read a file with the product and return the outcome; raises what is no error of the user.

    `mdf_python` is a Python that has mdfreader; without it channels of MDF files are not compared.
    """
    suffix = path.suffix.lower()
    try:
        if suffix == ".dbc":
            return _compare_database(path)
        if suffix in DATABASE_SUFFIXES:
            read_databases(_map(path), cantools)
            return Outcome("read")
        if suffix in MDF_SUFFIXES:
            return _compare_channels(path, mdf_python)
        if suffix in LOG_SUFFIXES or holds_frames(path):
            return _read_log(path)
        guess_map({path: path.name})
        return Outcome("read")
    except SpecError as error:
        problem = error.problems[0]
        text = " ".join(f"{problem.label}; {problem.help}".split())
        text = text.replace(f"`{path}`", "the file").replace(str(path), "the file")
        return Outcome(re.sub(r"`(/|\.\.)[^`]*`", "the file", text)[:MAX_REASON].rstrip("; "))


def _map(database: Path | None = None) -> RecordingMap:
    """Return a map without columns, with a database if one is given."""
    place = Span(Source("public"), 1, 1)
    node = ScalarNode(str(database), place)
    databases = (CanDatabase(node),) if database else ()
    return RecordingMap("public", "", parse_unit("s"), {}, {}, place, databases=databases)


def _open(path: Path, database: Path | None = None) -> RecordedFile:
    """Open a recording; raises SpecError."""
    problems = Problems()
    file = open_recording(path, _map(database), problems)
    problems.raise_if_errors()
    return file


def _read_log(path: Path) -> Outcome:
    """Read a log with a database that takes the bytes of its first messages as a number.

    The frames are those that the product reads, so that the values do not count as compared.
    """
    log = read_can_log(path, Source(path.name), can, _map())
    messages, names = [DATABASE], []
    for k, (key, frames) in enumerate(list(log.frames.items())[:MAX_SIGNALS]):
        size = min(len(frame.data) for frame in frames)
        if size:
            number = key.identifier | (1 << 31 if key.is_extended else 0)
            messages.append(f"BO_ {number} M{k}: {size} X")
            messages.append(f' SG_ s : 0|{8 * min(size, 8)}@1+ (1,0) [0|0] "" X\n')
            names.append((f"M{k}.s", frames, min(size, 8)))
    with TemporaryDirectory() as folder:
        database = Path(folder) / "log.dbc"
        database.write_text("\n".join(messages), "utf-8")
        file = _open(path, database) if names else None
        for name, frames, size in names:
            if file is None or list(file.names).count(name) != 1:
                continue
            wanted = [float(int.from_bytes(frame.data[:size], "little")) for frame in frames]
            if list(file.read(name).values) != wanted:
                return Outcome(f"differs: {name}")
    return Outcome("read")


def _compare_database(path: Path) -> Outcome:
    """Compare random frames of all messages of a database with the oracle."""
    frames: dict[tuple[int, bool], list[tuple[int, bytes]]] = {}
    found: dict[tuple[int, bool], list[OracleMessage]] = {}
    lines: list[str] = []
    for message in read_dbc(path):
        if MAX_IDENTIFIER[False] < message.identifier <= MAX_IDENTIFIER[True]:
            message.is_extended = True
        key = message.identifier, message.is_extended
        if message.size > CAN_FD_BYTES or key[0] > MAX_IDENTIFIER[key[1]]:
            continue
        found.setdefault(key, []).append(message)
        for data in _random_frames(message) if key not in frames or message.size else ():
            digits = f"{key[0]:08X}" if key[1] else f"{key[0]:03X}"
            mark = "##0" if len(data) > CAN_BYTES else "#"
            frames.setdefault(key, []).append((len(lines), data))
            lines.append(f"({len(lines)}.000000) can0 {digits}{mark}{data.hex()}")
    if not lines:
        read_databases(_map(path), cantools)
        return Outcome("read")
    with TemporaryDirectory() as folder:
        log = Path(folder) / "random.log"
        log.write_text("\n".join(lines) + "\n", "utf-8")
        return _compare_signals(_open(log, path), found, frames)


def _random_frames(message: OracleMessage) -> Iterator[bytes]:
    """Yield random frames of a message; some of them select each multiplexed signal."""
    generator = random.Random(message.identifier)
    for _ in range(FRAMES):
        yield generator.randbytes(message.size)
    for signal in message.signals:
        for _ in range(FRAMES // 2 if signal.parent else 0):
            data, selected = bytearray(generator.randbytes(message.size)), signal
            chain: list[tuple[OracleSignal, int]] = []
            while selected.parent and len(chain) < len(message.signals):
                parent = message.signal(selected.parent)
                if parent is None:
                    break
                chain.append((parent, selected.ranges[0][0]))
                selected = parent
            for parent, number in reversed(chain):
                if parent.bytes_needed <= message.size:
                    parent.write(data, number)
            yield bytes(data)


def _compare_signals(
    file: RecordedFile,
    found: dict[tuple[int, bool], list[OracleMessage]],
    frames: dict[tuple[int, bool], list[tuple[int, bytes]]],
) -> Outcome:
    """Compare the signals of a file with the values of the oracle in the same frames.

    Names that stand for several signals even with their identifier are passed over.
    """
    names = list(file.names)
    known = set(names)
    count = 0
    for key, messages in found.items():
        for message in messages:
            for signal in message.signals:
                name = f"{message.name}.{signal.name}"
                longer = f"{key[0]:#x}.{name}"
                name = longer if longer in known else name
                wanted = {
                    float(time): signal.value(data)
                    for time, data in frames[key]
                    if max(signal.bytes_needed, message.size) <= len(data)
                    and message.is_present(signal, data)
                }
                if names.count(name) > 1:
                    continue
                if name not in known:
                    return Outcome(f"differs: {name} is missing", count)
                if wanted and not _is_equal(file, name, wanted):
                    return Outcome(f"differs: {name}", count)
                count += bool(wanted)
    return Outcome("read", count)


def _is_equal(file: RecordedFile, name: str, wanted: dict[float, float]) -> bool:
    """Return whether a signal has the wanted values by their time; missing ones are equal."""
    samples = file.read(name)
    times = [float(time) for time in samples.stamps or ()]
    got = dict(zip(times, samples.values, strict=True))
    return got.keys() == wanted.keys() and all(
        value is None or _is_close(value, wanted[time]) for time, value in got.items()
    )


def _is_close(value: float, other: float) -> bool:
    """Return whether two values differ by rounding only."""
    if math.isnan(value) or math.isnan(other):
        return math.isnan(value) and math.isnan(other)
    return math.isclose(value, other, rel_tol=TOLERANCE, abs_tol=1e-12)


def _compare_channels(path: Path, mdf_python: str) -> Outcome:
    """Read channels of an MDF file, and compare them with mdfreader if there is one."""
    file = _open(path)
    single = [name for name in dict.fromkeys(file.names) if list(file.names).count(name) == 1]
    reference = _read_reference(path, mdf_python) if mdf_python else {}
    chosen = [name for name in reference if name in single][:MAX_CHANNELS]
    for name in chosen or single[:MAX_CHANNELS]:
        try:
            samples = file.read(name)
        except SpecError:
            if len(single) == 1 or name in chosen:
                raise
            continue
        if name not in chosen:
            continue
        want = reference[name]
        values = [math.nan if value is None else value for value in samples.values]
        times = [float(time) for time in samples.stamps or ()]
        is_same = len(values) == want["count"] and all(
            _is_close(a, b)
            for pairs in ((values, want["values"]), (times, want["times"]))
            for a, b in zip(*pairs, strict=False)
        )
        if not is_same:
            return Outcome(f"differs: {name}")
    return Outcome("read", len(chosen))


def _read_reference(path: Path, mdf_python: str) -> dict[str, Any]:
    """Return the channels that mdfreader reads; none if it cannot read the file."""
    words = [mdf_python, str(Path(__file__).with_name("mdf_oracle.py")), str(path)]
    done = subprocess.run(
        [*words, str(4 * MAX_CHANNELS)], capture_output=True, text=True, check=False
    )
    try:
        return dict(json.loads(done.stdout.strip().splitlines()[-1]))
    except (IndexError, ValueError):
        return {}
