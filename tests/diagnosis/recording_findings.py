"""Checking: recordings of the driveline that drives, looked at with its model."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from diagnosis.data_quality.column_hypothesis import find_clock_and_sign_errors
from diagnosis.data_quality.recording_check import RecordingCheck, check_recordings
from engine.recordings.recording import Recording
from language.overlays.expand_document import Project
from modewright.runtime.back_end_choice import simulate_resolved
from tests.diagnosis.small_driveline import document, driveline, read_recording_map


def check(*recordings: Recording) -> RecordingCheck:
    mistakes = partial(
        find_clock_and_sign_errors, document(), Project(Path()), driveline(), read_recording_map()
    )
    return check_recordings(
        recordings, read_recording_map(), driveline(), simulate_resolved, mistakes
    )


def finding_keys(found: RecordingCheck) -> set[tuple[str, str, str]]:
    return {(one.severity, one.kind, one.channel) for one in found.findings}
