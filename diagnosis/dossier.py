"""Dossier: all that is known when a diagnosis has ended, for those who tell it on."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from diagnosis.case import Case
from diagnosis.diagnose import Diagnosis
from diagnosis.finding import Finding, format_findings
from diagnosis.recording_check import RecordingCheck
from diagnosis.verdict import Verdict
from engine.recordings.recording_window import file_of
from language.model.automaton import Automaton


@dataclass(frozen=True)
class DiagnosisReport:
    """A verdict on `case`, with the check of its recordings.

    `diagnosis` is None where nothing was concluded: the recordings are not usable, or the
    diagnosis was ended before it came to a verdict, as `ended` says.
    `left_out` are recordings that were not used for what was found of them.
    `held_out` are hashes of the files that were opened after the verdict.
    """

    case: Case
    automaton: Automaton
    check: RecordingCheck
    verdict: Verdict
    diagnosis: Diagnosis | None = field(default=None, repr=False)
    held_out: Mapping[str, str] = field(default_factory=dict)
    unused_recordings: tuple[str, ...] = ()
    end_reason: str = ""

    @property
    def name(self) -> str:
        """The name of what was diagnosed."""
        return self.automaton.name

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What was found of the recordings, the worst first."""
        return self.check.findings


def verdict_to_json(verdict: Verdict) -> dict[str, Any]:
    """Return a verdict as JSON has it: a number that is not finite is null."""
    found = replace_non_finite(verdict.to_json())
    assert isinstance(found, dict)
    return found


def replace_non_finite(value: Any) -> Any:
    """Return plain data in which numbers that are not finite are None."""
    if isinstance(value, dict):
        return {key: replace_non_finite(one) for key, one in value.items()}
    if isinstance(value, list):
        return [replace_non_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


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


def unusable_reasons(check: RecordingCheck) -> tuple[str, ...]:
    """Return why no conclusion can be drawn from recordings."""
    return (
        "the recordings are not usable",
        *(text for _, text in format_findings(recording_errors(check))),
    )


def undecided_verdict(
    messages: tuple[str, ...], train: Mapping[str, str], runtime_s: float
) -> Verdict:
    """Return the verdict where nothing was concluded, for the reasons in its messages."""
    return Verdict(
        "unknown", (), (), 1.0, (), (), {"train": {}}, {}, None, runtime_s, messages, train
    )


def file_digests(case: Case, files: tuple[Path, ...]) -> dict[str, str]:
    """Return the first 16 hexadecimal digits of SHA-256 of each file, by name."""
    return {
        case.name_of(path): hashlib.sha256(file_of(path).read_bytes()).hexdigest()[:16]
        for path in files
    }
