"""Dossier: all that is known when a diagnosis has ended, for those who tell it on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from diagnosis.pipeline.case import Case
from diagnosis.pipeline.diagnose import Diagnosis
from diagnosis.pipeline.usable_recordings import recording_errors
from diagnosis.quality.finding import Finding, format_findings
from diagnosis.quality.recording import RecordingCheck
from diagnosis.result.verdict import Verdict
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
