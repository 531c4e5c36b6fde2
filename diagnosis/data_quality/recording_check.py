"""Recording check: whether recorded data are fit for a diagnosis, with all findings on them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from diagnosis.data_quality.channel import ChannelCheck, channel_findings, check_channel
from diagnosis.data_quality.clock_overlap import find_clock_mismatches
from diagnosis.data_quality.excitation import Excitation, analyse_excitation
from diagnosis.data_quality.finding import Finding, sort_by_severity
from diagnosis.data_quality.model_agreement import OutputAgreement, compare_with_simulation
from diagnosis.data_quality.outlier import drop_huge_values, find_long_pauses, find_outliers
from diagnosis.data_quality.output_comparison import ReferenceModel, RunFunction, run_interpreter
from diagnosis.data_quality.unit_correction import (
    find_corrections,
    find_millisecond_time,
    replace_corrected,
)
from diagnosis.data_quality.unit_sign_clock_errors import (
    agrees_with_other_outputs,
    find_redundant_speeds,
    find_unit_sign_clock_errors,
)
from engine.recordings.recording import Recording
from engine.recordings.recording_file import Assumption
from language.model.automaton import Automaton
from language.model.system import RecordingMap

ClockErrorSearch = Callable[[Sequence[Recording]], list[Finding] | None]
DISQUALIFYING_KINDS = ("no_signal", "too_short", "outlier", "leap", "time")
"""Kinds of findings after which a recording is not compared with the model."""
MIN_SAMPLES = 100
"""Smallest useful number of samples of a channel."""


@dataclass(frozen=True)
class RecordingCheck:
    """The channels, findings (errors first), excitation and agreement with a simulation.

    `assumptions` are what was taken of each recording that its file does not state.
    """

    channels: tuple[ChannelCheck, ...]
    findings: tuple[Finding, ...]
    excitation: Excitation
    agreements: tuple[OutputAgreement, ...] = ()
    assumptions: tuple[tuple[str, Assumption], ...] = ()

    @property
    def is_usable(self) -> bool:
        """Whether there is no error among the findings."""
        return not any(finding.severity == "error" for finding in self.findings)


def check_recordings(
    recordings: Sequence[Recording],
    mapping: RecordingMap,
    automaton: Automaton | None = None,
    run_programs: RunFunction = run_interpreter,
    find_clock_errors: ClockErrorSearch = lambda recordings: None,
    file_findings: Sequence[Finding] = (),
) -> RecordingCheck:
    """Return the checks of recordings; with an automaton also of units, signs and clocks.

    `find_clock_errors` searches wrong clocks and signs by prediction, or returns None if it cannot;
    the clock findings of the simulation are then warnings. Sampled automata are not simulated.
    Raises SpecError if the simulation of a recording fails.
    """
    assumptions = tuple((one.name, item) for one in recordings for item in one.assumptions)
    mismatches = {one.name: find_clock_mismatches(one) for one in recordings}
    early_findings: list[Finding] = []
    for one in recordings:
        early_findings += find_outliers(one, automaton)
        early_findings += mismatches[one.name] or find_long_pauses(one)
    recordings = [drop_huge_values(recording) for recording in recordings]
    channels, findings = _check_channels(recordings, early_findings)
    excited = analyse_excitation(recordings, channels)
    outlying = {(finding.recording, finding.channel) for finding in early_findings}
    findings += [
        finding
        for finding in _find_missing_signals(recordings, channels, mapping, automaton)
        if (finding.recording, finding.channel) not in outlying
    ]
    findings += [*_find_insufficient_data(recordings, channels, excited), *file_findings]
    reference = None
    if automaton is not None and automaton.period is None:
        reference = ReferenceModel(automaton, mapping, run_programs)
        for one in recordings:
            findings += [] if mismatches[one.name] else find_millisecond_time(one, reference)
    broken = {finding.recording for finding in findings if finding.kind in DISQUALIFYING_KINDS}
    usable = [one for one in recordings if "" not in broken and one.name not in broken]
    agreements: list[OutputAgreement] = []
    if automaton is None and usable:
        findings += find_redundant_speeds(usable)
    if reference is not None and usable:
        agreements = compare_with_simulation(usable, reference)
        errors = find_unit_sign_clock_errors(agreements, reference.automaton, mapping, usable)
        corrections = find_corrections(agreements, usable, reference, errors)
        errors = replace_corrected(errors, corrections)
        errors = [one for one in errors if not agrees_with_other_outputs(one, agreements)]
        findings += _merge_clock_errors(errors, usable, find_clock_errors)
    return RecordingCheck(
        tuple(channels), sort_by_severity(findings), excited, tuple(agreements), assumptions
    )


def _check_channels(
    recordings: Sequence[Recording], earlier: Sequence[Finding]
) -> tuple[list[ChannelCheck], list[Finding]]:
    """Return the checks, and all findings without gaps in recordings whose time leaps."""
    leapt = {finding.recording for finding in earlier if finding.kind == "leap"}
    channels, findings = [], list(earlier)
    for recording in recordings:
        for channel in recording.channels.values():
            check = check_channel(recording, channel)
            channels.append(check)
            findings += channel_findings(check, channel.column.compare is not None)
    return channels, [
        one for one in findings if one.kind not in ("dropped", "gap") or one.recording not in leapt
    ]


def _merge_clock_errors(
    findings: Sequence[Finding],
    recordings: Sequence[Recording],
    find_clock_errors: ClockErrorSearch,
) -> list[Finding]:
    """Return findings with those on clocks and signs replaced by `find_clock_errors`.

    A sign error of an input needs a sign finding of the simulation too. If the search is
    impossible, clock findings become warnings.
    """
    others = [finding for finding in findings if finding.kind not in ("clock_offset", "sign")]
    wrong = {finding.recording for finding in others if finding.severity == "error"}
    right = [one for one in recordings if "" not in wrong and one.name not in wrong]
    signs = [finding for finding in findings if finding.kind == "sign"]
    sure = find_clock_errors(right) if right else []
    if sure is None:
        hints = [finding for finding in findings if finding.kind == "clock_offset"]
        return [*others, *signs, *[dataclasses.replace(one, severity="warning") for one in hints]]
    shared = [finding for finding in signs if not finding.recording]
    against = {finding.recording for finding in signs}
    fed = {c.column.name for one in recordings for c in one.channels.values() if c.column.to}
    sure = [f for f in sure if f.kind != "sign" or f.channel not in fed or f.recording in against]
    known = any(finding.kind == "sign" and not finding.recording for finding in sure)
    return [*others, *(sure if known or not shared else shared)]


def _find_missing_signals(
    recordings: Sequence[Recording],
    checks: Sequence[ChannelCheck],
    mapping: RecordingMap,
    automaton: Automaton | None,
) -> list[Finding]:
    """Return errors for missing channels and for inputs that must not be constant.

    An input without a default that is constant everywhere drives nothing. One that is noisy in most
    recordings cannot be constant in another one.
    """
    names = dict.fromkeys(name for recording in recordings for name in recording.channels)
    if automaton is not None:
        names |= dict.fromkeys(used_columns(mapping, automaton))
    text = "is not recorded: the signal is missing"
    found = [
        Finding("no_signal", recording.name, name, text, "error")
        for recording in recordings
        for name in names
        if name not in recording.channels
    ]
    inputs = automaton.inputs if automaton is not None else {}
    for name in names:
        column = mapping.columns[name]
        each = [check for check in checks if check.name == name]
        still = [check for check in each if check.low == check.high]
        if column.to is None or column.to not in inputs or not still:
            continue
        text = f"is {still[0].low:g} all the time: the signal is missing"
        if len(still) == len(each) and inputs[column.to].default is None:
            where = "" if len({check.low for check in still}) == 1 else still[0].recording
            found.append(Finding("no_signal", where, name, text, "error"))
        noisy = [check for check in each if check.noise > 0.5 * check.quantum]
        if 2 * len(noisy) > len(each):
            found += [Finding("no_signal", one.recording, name, text, "error") for one in still]
    return found


def used_columns(mapping: RecordingMap, automaton: Automaton | None) -> list[str]:
    """Return the columns that an automaton reads or compares; all if there are none."""
    if automaton is None:
        return list(mapping.columns)
    return [
        column.name
        for column in mapping.columns.values()
        if column.to in automaton.inputs or column.compare in automaton.outputs
    ] or list(mapping.columns)


def _find_insufficient_data(
    recordings: Sequence[Recording], checks: Sequence[ChannelCheck], excitation: Excitation
) -> list[Finding]:
    """Return errors for recordings that are too short, and for missing excitation."""
    found = []
    is_single = len(recordings) == 1
    purpose = "to tell effects apart" if is_single else "to be used"
    for recording in recordings:
        fewest = min((c.samples for c in checks if c.recording == recording.name), default=0)
        if fewest < MIN_SAMPLES:
            text = f"{fewest} samples of a channel are too few {purpose}"
            found.append(Finding("too_short", recording.name, "", text, "error"))
    name = recordings[0].name if is_single else ""
    if excitation.is_absent:
        names = ", ".join(f"`{signal.name}`" for signal in excitation.inputs) or "no input"
        text = f"nothing is excited: {names} neither steps nor varies above its noise"
        found.append(Finding("no_excitation", name, "", text, "error"))
    return found
