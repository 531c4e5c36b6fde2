"""Workable: whether a model can follow a recording at all, even one that is wanted anyway."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path

import numpy as np

from diagnosis.case import Case
from diagnosis.dossier import errors_of, usable
from diagnosis.finding import told
from diagnosis.recording_check import RecordingCheck
from engine.recording import Channel, Recording

FEWEST = 10
"""Samples of a channel from which on something can be said."""
SHORTEST = 1e-6
"""Time [s] between samples below which the unit of the time is a mistake."""
MOST = 10_000_000
"""Samples, at the usual distance, between the first and the last one: a day at 100 Hz."""
LARGEST = 1e12
"""Value in SI beyond which a run of a model is given up."""


class OpenedLater(Mapping[Path, Recording]):
    """Recordings as they were read; those held out are read when they are asked for, no sooner.

    Raises ValueError for one of these that no model can follow, SpecError and ToolMissing as
    `read` does.
    """

    def __init__(
        self,
        known: Mapping[Path, Recording],
        held_out: Collection[Path],
        read: Callable[[Path], Recording],
    ) -> None:
        """Take what is known, and how others are read."""
        self._known = dict(known)
        self._held_out = held_out
        self._read = read

    def __getitem__(self, path: Path) -> Recording:
        if path not in self._known and path in self._held_out:
            recording = self._read(path)
            if why := unworkable(recording):
                raise ValueError(why)
            self._known[path] = recording
        return self._known[path]

    def __iter__(self) -> Iterator[Path]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)


def workable(case: Case, check: RecordingCheck, anyway: bool) -> tuple[tuple[Path, ...], list[str]]:
    """Return the recordings of a case to conclude from, and why others are none of them."""
    kept = case.train if anyway else usable(check, case)
    why = [text for _, text in told(errors_of(check))] if kept != case.train else []
    hopeless = {file: text for file in kept if (text := unworkable(case.read[file]))}
    why += [f"{case.name_of(file)}: {text}" for file, text in hopeless.items()]
    return tuple(file for file in kept if file not in hopeless), why


def unworkable(recording: Recording) -> str:
    """Return why no model can follow a recording; nothing where one can."""
    for channel in recording.channels.values():
        why = _too_large(channel) or (_no_course(channel) if channel.column.compare else "")
        if why:
            return f"`{channel.column.name}` has {why}"
    return ""


def _too_large(channel: Channel) -> str:
    largest = float(np.max(np.abs(channel.array)))
    return f"values up to {largest:.2g} in SI, beyond {LARGEST:g}" if largest > LARGEST else ""


def _no_course(channel: Channel) -> str:
    """Return why what is compared with a model shows no course over time."""
    count = len(channel.times)
    if count < FEWEST:
        return f"{count} of the {FEWEST} samples that are needed"
    usual = float(np.median(np.diff(channel.seconds)))
    if usual < SHORTEST:
        return f"samples {usual:.2g} s apart: is its time in another unit?"
    lasts = float(channel.times[-1] - channel.times[0])
    if lasts > MOST * usual:
        return f"samples {usual:.2g} s apart in {lasts:.2g} s: `FILE@0..60` uses a part of it"
    return ""
