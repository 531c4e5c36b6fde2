"""Workable: whether a model can follow a recording at all, even one that is wanted anyway."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path

import numpy as np

from diagnosis.pipeline.case import Case
from diagnosis.quality.finding import Finding, format_findings
from diagnosis.quality.recording import RecordingCheck
from engine.recordings.recording import Channel, Recording


def usable_recordings(check: RecordingCheck, case: Case) -> tuple[Path, ...]:
    """Return the recordings to conclude from: none where half of them or more have an error.

    A mistake in a few is one of these files, which are left out; in many it is one of the map.
    """
    bad = {finding.recording for finding in recording_errors(check)}
    kept = tuple(file for file in case.train if case.name_of(file) not in bad)
    if "" in bad or 2 * len(kept) <= len(case.train):
        return () if bad else case.train
    return kept


def recording_errors(check: RecordingCheck) -> list[Finding]:
    """Return what makes recordings worthless."""
    return [finding for finding in check.findings if finding.severity == "error"]


MIN_SAMPLES = 10
"""Samples of a channel from which on something can be said."""

MIN_SAMPLE_PERIOD = 1e-6
"""Time [s] between samples below which the unit of the time is a mistake."""

MAX_SAMPLES = 10_000_000
"""Samples, at the usual distance, between the first and the last one: a day at 100 Hz."""

MAX_VALUE = 1e12
"""Value in SI beyond which a run of a model is given up."""


class LazyRecordings(Mapping[Path, Recording]):
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
            if reason := unusable_reason(recording):
                raise ValueError(reason)
            self._known[path] = recording
        return self._known[path]

    def __iter__(self) -> Iterator[Path]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)


def select_usable(
    case: Case, check: RecordingCheck, anyway: bool
) -> tuple[tuple[Path, ...], list[str]]:
    """Return the recordings of a case to conclude from, and why others are none of them."""
    usable_files = case.train if anyway else usable_recordings(check, case)
    reasons = (
        [text for _, text in format_findings(recording_errors(check))]
        if usable_files != case.train
        else []
    )
    rejected = {
        file: text for file in usable_files if (text := unusable_reason(case.recordings[file]))
    }
    reasons += [f"{case.name_of(file)}: {text}" for file, text in rejected.items()]
    return tuple(file for file in usable_files if file not in rejected), reasons


def unusable_reason(recording: Recording) -> str:
    """Return why no model can follow a recording; nothing where one can."""
    for channel in recording.channels.values():
        reason = _range_fault(channel) or (
            _sampling_fault(channel) if channel.column.compare else ""
        )
        if reason:
            return f"`{channel.column.name}` has {reason}"
    return ""


def _range_fault(channel: Channel) -> str:
    largest = float(np.max(np.abs(channel.array)))
    return f"values up to {largest:.2g} in SI, beyond {MAX_VALUE:g}" if largest > MAX_VALUE else ""


def _sampling_fault(channel: Channel) -> str:
    """Return why what is compared with a model shows no course over time."""
    count = len(channel.times)
    if count < MIN_SAMPLES:
        return f"{count} of the {MIN_SAMPLES} samples that are needed"
    sample_period = float(np.median(np.diff(channel.seconds)))
    if sample_period < MIN_SAMPLE_PERIOD:
        return f"samples {sample_period:.2g} s apart: is its time in another unit?"
    duration = float(channel.times[-1] - channel.times[0])
    if duration > MAX_SAMPLES * sample_period:
        return f"samples {sample_period:.2g} s apart in {duration:.2g} s: `FILE@0..60` uses a part of it"
    return ""
