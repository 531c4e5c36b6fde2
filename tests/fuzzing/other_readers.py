"""Other readers: minimal readers of the subjects' files, which import nothing of the product.

Each returns the samples (time stamp, value) of the signal `u`, or None for a file that is irregular
in any way; the product then has to refuse it or to tell what it assumes.
"""

from __future__ import annotations

import csv
import math
import re
import struct
from collections.abc import Callable
from pathlib import Path

from tests.public.dbc_oracle import parse_dbc

NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
MISSING = ("", "nan", "null", "--")
FRAME = re.compile(r"\((\d+\.\d+)\)\s+(\w+)\s+([0-9A-Fa-f]{3})#((?:[0-9A-Fa-f]{2}){0,8})", re.ASCII)
ASC_FRAME = re.compile(
    r"(\d+\.\d+) 1 ([0-9a-f]{1,3}) Rx d (\d) ((?:[0-9a-f]{2} )*[0-9a-f]{2})", re.IGNORECASE
)

Samples = list[tuple[float, float]]


def read_table(folder: Path) -> Samples | None:
    """Read `run.csv`: the columns `t` and `u` of a regular table."""
    lines = _lines(folder / "run.csv")
    if not lines:
        return None
    head, *rows = [[cell.strip() for cell in row] for row in csv.reader(lines, strict=True)]
    if head.count("t") != 1 or head.count("u") != 1 or any(len(row) != len(head) for row in rows):
        return None
    found = [(row[head.index("t")], row[head.index("u")]) for row in rows]
    if not all(NUMBER.fullmatch(t) for t, _ in found):
        return None
    if not all(NUMBER.fullmatch(u) or u.lower() in MISSING for _, u in found):
        return None
    return [(float(t), float(u)) for t, u in found if u.lower() not in MISSING]


def read_candump(folder: Path) -> Samples | None:
    """Read `run.log`: the frames 0x100 of one bus."""
    lines = _lines(folder / "run.log")
    frames = [FRAME.fullmatch(line) for line in lines or ()]
    found = [frame for frame in frames if frame is not None]
    if len(found) < len(frames) or len({frame[2] for frame in found}) != 1:
        return None
    return _torques([(frame[1], frame[3], frame[4]) for frame in found])


def read_asc(folder: Path) -> Samples | None:
    """Read `run.asc`: the frames 0x100 of bus 1 below a regular head."""
    head, *lines = [" ".join(line.split()) for line in _lines(folder / "run.asc", "cp1252") or [""]]
    frames = [ASC_FRAME.fullmatch(line) for line in lines[1:]]
    if not head.startswith("date ") or lines[:1] != ["base hex timestamps absolute"]:
        return None
    if not all(frame and len(frame[4].split()) == int(frame[3]) for frame in frames):
        return None
    return _torques([(frame[1], frame[2], frame[4]) for frame in frames if frame])


def _torques(frames: list[tuple[str, str, str]]) -> Samples | None:
    """Return the values of `u` in frames (stamp, identifier, data) of the unchanged database."""
    own = [
        (float(stamp), bytes.fromhex(data)) for stamp, key, data in frames if int(key, 16) == 0x100
    ]
    if not own or any(len(data) < 4 or not math.isfinite(stamp) for stamp, data in own):
        return None
    samples = [(stamp, 0.25 * struct.unpack_from("<h", data)[0]) for stamp, data in own]
    return [one for k, one in enumerate(samples) if not k or own[k] != own[k - 1]]


def read_database(folder: Path) -> Samples | None:
    """Read the frames of the unchanged `run.log` by the signal `u` of `car.dbc`."""
    frames = [FRAME.fullmatch(line) for line in _lines(folder / "run.log") or ()]
    text = (folder / "car.dbc").read_bytes().decode("utf-8", "replace").replace("\v", " ")
    messages = [one for one in parse_dbc(text) if one.identifier == 0x100]
    found = [(m, s) for m in messages for s in m.signals if s.name == "u" and not m.is_extended]
    if len(found) != 1 or len(messages) != 1:
        return None
    message, signal = found[0]
    data = [(float(frame[1]), bytes.fromhex(frame[4])) for frame in frames if frame]
    if max(signal.bytes_needed, message.size) > 4 or signal.parent or not signal.length:
        return None
    return [(stamp, signal.value(bytes_)) for stamp, bytes_ in data]


def _lines(path: Path, encoding: str = "utf-8-sig") -> list[str] | None:
    """Return the lines of a text that are not blank; None for another encoding."""
    try:
        text = path.read_bytes().decode(encoding)
    except UnicodeDecodeError:
        return None
    return [line for line in re.split(r"[\n\r\v\f]", text) if line.strip()]


READERS: dict[str, tuple[str, str, Callable[[Path], Samples | None]]] = {
    "csv": ("run.csv", "run.csv", read_table),
    "candump": ("run.log", "run.log", read_candump),
    "asc": ("run.asc", "run.asc", read_asc),
    "dbc": ("car.dbc", "run.log", read_database),
}
"""The mutated file, the recording and the other reader of each subject."""


def is_close(own: Samples, other: Samples) -> bool:
    """Return whether two series of samples differ by rounding only."""
    return len(own) == len(other) and all(
        math.isclose(a, b, rel_tol=1e-9, abs_tol=1e-12)
        for first, second in zip(own, other, strict=True)
        for a, b in zip(first, second, strict=True)
    )
