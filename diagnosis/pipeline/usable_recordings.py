"""Usable recordings: which recordings a diagnosis can use, even if the user ignores errors."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path

import numpy as np

from diagnosis.data_quality.channel import MIN_SAMPLES
from diagnosis.data_quality.clock_overlap import find_clock_mismatches
from diagnosis.data_quality.finding import Finding, format_findings
from diagnosis.data_quality.recording_check import RecordingCheck
from diagnosis.pipeline.diagnosis_case import Case
from engine.recordings.recording import Channel, Recording
from language.text.diagnostic import Problems


def usable_recordings(check: RecordingCheck, case: Case) -> tuple[Path, ...]:
    """Return the training recordings without errors; none if half of them or more have one.

    An error in few recordings is one of these files; in many recordings, or without a recording, it
    is one of the map, and no recording is usable.
    """
    bad = {finding.recording for finding in recording_errors(check)}
    kept = tuple(file for file in case.train if case.name_of(file) not in bad)
    if "" in bad or 2 * len(kept) <= len(case.train):
        return () if bad else case.train
    return kept


def recording_errors(check: RecordingCheck) -> list[Finding]:
    """Return the findings of severity `error`, in their order."""
    return [finding for finding in check.findings if finding.severity == "error"]


MIN_SAMPLE_PERIOD = 1e-6
"""Smallest sample period [s]; below it the unit of the time is wrong."""

MAX_SAMPLES = 10_000_000
"""Largest number of samples between the first and the last stamp: a day at 100 Hz."""

MAX_VALUE = 1e12
"""Magnitude [SI] above which a run of a model diverges."""


class LazyRecordings(Mapping[Path, Recording]):
    """Recordings by path; held-out ones are read at their first access.

    Access raises ValueError for a held-out recording that no model can follow, KeyError for an
    unknown path, and the errors of the reader.
    """

    def __init__(
        self,
        known: Mapping[Path, Recording],
        held_out: Collection[Path],
        read: Callable[[Path], Recording],
    ) -> None:
        """Store known recordings and the function that reads a held-out one at its first access.

        Iteration and length cover only the recordings that are known so far.
        """
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
    """Return the usable training recordings of a case, and why others are left out.

    With `anyway` errors of the check are ignored, but not recordings that no model can follow
    (`unusable_reason`). The reasons are the formatted errors of the check, if they exclude a
    recording, then `<name>: <reason>` for each recording that no model can follow. All recordings
    must be in `recordings` of the case. Raises SpecError if `anyway` leaves no recording, for each
    one whose clocks do not overlap.
    """
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
    kept = tuple(file for file in usable_files if file not in rejected)
    if anyway and not kept:
        _refuse_clock_faults(case)
    return kept, reasons


def _refuse_clock_faults(case: Case) -> None:
    """Raise SpecError, at the place of the file, for recordings whose clocks do not overlap."""
    problems = Problems()
    for path in case.train:
        recording = case.recordings[path]
        place = recording.place or case.mapping.span
        if text := _clock_fault(recording):
            problems.error("time", place, text, "`time` of a map gives the unit of its clock")
    problems.raise_if_errors()


def unusable_reason(recording: Recording) -> str:
    """Return why no model can follow a recording, for its first faulty channel; "" if one can.

    A channel is faulty with a value beyond `MAX_VALUE` (1e12, SI); a compared one also with fewer
    than `MIN_SAMPLES` (10) samples, a median period below `MIN_SAMPLE_PERIOD` (1 us), or a duration
    above `MAX_SAMPLES` periods. The text is "`column` has ...". Last, two channels whose clocks do
    not overlap are a reason (`find_clock_mismatches`).
    """
    for channel in recording.channels.values():
        reason = _range_fault(channel) or (
            _sampling_fault(channel) if channel.column.compare else ""
        )
        if reason:
            return f"`{channel.column.name}` has {reason}"
    return _clock_fault(recording)


def _clock_fault(recording: Recording) -> str:
    """Return the first pair of channels whose clocks do not overlap, else ""."""
    return next((finding.text for finding in find_clock_mismatches(recording)), "")


def _range_fault(channel: Channel) -> str:
    """Return a phrase if values of a channel are too large, else ""."""
    largest = float(np.max(np.abs(channel.array)))
    return f"values up to {largest:.2g} in SI, beyond {MAX_VALUE:g}" if largest > MAX_VALUE else ""


def _sampling_fault(channel: Channel) -> str:
    """Return a phrase if a channel has too few samples or an implausible sample period, else ""."""
    count = len(channel.times)
    if count < MIN_SAMPLES:
        return f"{count} of the {MIN_SAMPLES} samples that are needed"
    sample_period = float(np.median(np.diff(channel.seconds)))
    if sample_period < MIN_SAMPLE_PERIOD:
        return f"samples {sample_period:.2g} s apart: is its time in another unit?"
    duration = float(channel.times[-1] - channel.times[0])
    if duration > MAX_SAMPLES * sample_period:
        spacing = f"samples {sample_period:.2g} s apart in {duration:.2g} s"
        return f"{spacing}: `FILE@0..60` uses a part of it"
    return ""
