"""Checking: recordings of the driveline that drives, looked at with its model."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from diagnosis.mistakes import mistakes_of
from diagnosis.recording_check import RecordingCheck, check_recordings
from engine.recording import Recording
from language.project import Project
from modewright.compiled import carried_out
from tests.diagnosis.driving import (
    bench,
    document,
    driveline,
)


def check(*recordings: Recording) -> RecordingCheck:
    mistakes = partial(mistakes_of, document(), Project(Path()), driveline(), bench())
    return check_recordings(recordings, bench(), driveline(), carried_out, mistakes)


def seen(found: RecordingCheck) -> set[tuple[str, str, str]]:
    return {(one.severity, one.kind, one.channel) for one in found.findings}
