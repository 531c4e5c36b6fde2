"""Diagnosis report: all results of a diagnosis, from which files and sentences are made."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from diagnosis.data_quality.finding import Finding, format_findings
from diagnosis.data_quality.recording_check import RecordingCheck
from diagnosis.pipeline.diagnose import Diagnosis
from diagnosis.pipeline.diagnosis_case import Case
from diagnosis.pipeline.usable_recordings import recording_errors
from diagnosis.result.verdict import Verdict
from language.model.automaton import Automaton


@dataclass(frozen=True)
class DiagnosisReport:
    """A verdict on `case`, with the check of its recordings.

    `diagnosis` is None if the recordings are not usable or the diagnosis ended for `end_reason`.
    `held_out` are digests by name.
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
        """The name of the automaton."""
        return self.automaton.name

    @property
    def findings(self) -> tuple[Finding, ...]:
        """The findings on the recordings, errors first."""
        return self.check.findings


def unusable_reasons(check: RecordingCheck) -> tuple[str, ...]:
    """Return the messages of a verdict on unusable recordings, with the lines of errors."""
    return (
        "the recordings are not usable",
        *(text for _, text in format_findings(recording_errors(check))),
    )


def undecided_verdict(
    messages: tuple[str, ...], train: Mapping[str, str], runtime_s: float
) -> Verdict:
    """Return the verdict `unknown` without a diagnosis; `train` are digests by name."""
    return Verdict(
        "unknown", (), (), 1.0, (), (), {"train": {}}, {}, None, runtime_s, messages, train
    )


CONSTANT_MODEL_NRMSE = 1.0
"""Normalised error of the mean of a recorded signal."""


def unfollowed_signals(verdict: Verdict) -> Iterator[str]:
    """Yield a message for each signal whose misfit is NaN or above `CONSTANT_MODEL_NRMSE`."""
    for part, signals in verdict.fit.items():
        for name, misfit in signals.items():
            share = misfit.nrmse_after
            if share > CONSTANT_MODEL_NRMSE or math.isnan(share):
                where = f"{part.replace('_', ' ')}: free simulation misses `{name}`"
                yield f"{where} by {100 * share:.0f} % of its spread, a constant by 100 %"


def withdraw_nothing_missing(verdict: Verdict, unfollowed: Sequence[str]) -> Verdict:
    """Return the verdict, `unknown` for `nothing_missing` with `unfollowed` signals."""
    if unfollowed and verdict.verdict == "nothing_missing":
        return dataclasses.replace(verdict, verdict="unknown")
    return verdict
