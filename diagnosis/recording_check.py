"""Recording check: what recorded data are worth, before anything is concluded from them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from diagnosis.alike import alike
from diagnosis.channel_check import ChannelCheck, check_channel, findings_of
from diagnosis.consistency import Relation, relations
from diagnosis.disagreement import disagreements, go_together
from diagnosis.excitation import Excitation, excitation
from diagnosis.finding import Finding, by_severity
from diagnosis.free_run import Run, interpreted
from diagnosis.outlier import outliers, pauses, without_huge
from diagnosis.reference import reference_of
from diagnosis.remedy import cured, milliseconds, remedies
from engine.recording import Recording, pieces
from language.experiment import RecordingMap
from language.model import Automaton

Mistakes = Callable[[Sequence[Recording]], list[Finding] | None]
SHORTEST = 2.0
"""Time of a recording below which it tells nothing [s]: an observer needs 0.5 s to find in."""
BROKEN = ("no_signal", "too_short", "outlier", "leap", "time")
"""Findings after which a recording is compared with nothing."""
FEWEST = 100
"""Samples of a channel below which nothing can be told apart."""


@dataclass(frozen=True)
class RecordingCheck:
    """Facts about each channel, what was found (the worst first), and what is excited.

    `relations` say how recorded outputs go with simulated ones; none without an automaton.
    """

    channels: tuple[ChannelCheck, ...]
    findings: tuple[Finding, ...]
    excitation: Excitation
    relations: tuple[Relation, ...] = ()

    @property
    def is_usable(self) -> bool:
        """Tell whether a verdict about physics could be right."""
        return not any(finding.severity == "error" for finding in self.findings)


def check_recordings(
    recordings: Sequence[Recording],
    mapping: RecordingMap,
    automaton: Automaton | None = None,
    carry_out: Run = interpreted,
    mistakes: Mistakes = lambda recordings: None,
) -> RecordingCheck:
    """Return what is to be known of recordings; with an automaton also units, signs and clocks.

    `mistakes` finds wrong clocks and signs, or returns None where it cannot: what a simulation
    tells of clocks is a hint, no more.
    """
    strange = [f for one in recordings for f in (*outliers(one, automaton), *pauses(one))]
    recordings = [without_huge(recording) for recording in recordings]
    channels, findings = _each(recordings, strange)
    excited = excitation(recordings, channels)
    far = {(finding.recording, finding.channel) for finding in strange}
    findings += [
        finding
        for finding in _missing(recordings, channels, mapping, automaton)
        if (finding.recording, finding.channel) not in far
    ]
    findings += _too_little(recordings, channels, excited)
    reference = None
    if automaton is not None and automaton.period is None:
        reference = reference_of(automaton, mapping, carry_out)
        findings += [f for one in recordings for f in milliseconds(one, reference)]
    broken = {finding.recording for finding in findings if finding.kind in BROKEN}
    whole = [one for one in recordings if "" not in broken and one.name not in broken]
    found: list[Relation] = []
    if automaton is None and whole:
        findings += alike(whole)
    if reference is not None and whole:
        found = relations(whole, reference)
        odd = disagreements(found, reference.automaton, mapping, whole)
        odd = cured(odd, remedies(found, whole, reference, odd))
        odd = [finding for finding in odd if not go_together(finding, found)]
        findings += _compared(odd, whole, mistakes)
    return RecordingCheck(tuple(channels), by_severity(findings), excited, tuple(found))


def _each(
    recordings: Sequence[Recording], strange: Sequence[Finding]
) -> tuple[list[ChannelCheck], list[Finding]]:
    """Return the facts of each channel, and what was found beside what was `strange` before.

    Where stamps leap, gaps are no news.
    """
    leapt = {finding.recording for finding in strange if finding.kind == "leap"}
    channels, findings = [], list(strange)
    for recording in recordings:
        for channel in recording.channels.values():
            check = check_channel(recording, channel)
            channels.append(check)
            findings += findings_of(check, channel.column.compare is not None)
    return channels, [
        one for one in findings if one.kind not in ("dropped", "gap") or one.recording not in leapt
    ]


def _compared(
    odd: Sequence[Finding], recordings: Sequence[Recording], mistakes: Mistakes
) -> list[Finding]:
    """Return what is odd between channels, found by `mistakes` where that is possible."""
    others = [finding for finding in odd if finding.kind not in ("clock_offset", "sign")]
    wrong = {finding.recording for finding in others if finding.severity == "error"}
    right = [one for one in recordings if "" not in wrong and one.name not in wrong]
    signs = [finding for finding in odd if finding.kind == "sign"]
    sure = mistakes(right) if right else []
    if sure is None:
        hints = [finding for finding in odd if finding.kind == "clock_offset"]
        return [*others, *signs, *[dataclasses.replace(one, severity="warning") for one in hints]]
    shared = [finding for finding in signs if not finding.recording]
    against = {finding.recording for finding in signs}
    fed = {c.column.name for one in recordings for c in one.channels.values() if c.column.to}
    sure = [
        finding
        for finding in sure
        if finding.kind != "sign" or finding.channel not in fed or finding.recording in against
    ]
    known = any(finding.kind == "sign" and not finding.recording for finding in sure)
    return [*others, *(sure if known or not shared else shared)]


def _missing(
    recordings: Sequence[Recording],
    checks: Sequence[ChannelCheck],
    mapping: RecordingMap,
    automaton: Automaton | None,
) -> list[Finding]:
    """Channels that a recording lacks, and inputs that have one value where they must not.

    Without an input that has no default nothing drives the model; one that is noisy in other
    recordings cannot be without noise in this.
    """
    names = dict.fromkeys(name for recording in recordings for name in recording.channels)
    if automaton is not None:
        names |= dict.fromkeys(used_columns(mapping, automaton))
    found = [
        Finding(
            "no_signal", recording.name, name, "is not recorded: the signal is missing", "error"
        )
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
    """Return the columns that an automaton reads or compares; all of them without one."""
    if automaton is None:
        return list(mapping.columns)
    return [
        column.name
        for column in mapping.columns.values()
        if column.to in automaton.inputs or column.compare in automaton.outputs
    ] or list(mapping.columns)


def _too_little(
    recordings: Sequence[Recording], checks: Sequence[ChannelCheck], excited: Excitation
) -> list[Finding]:
    found = []
    total = sum(float(p.end - p.start) for recording in recordings for p in pieces(recording))
    fewest = min((check.samples for check in checks), default=0)
    name = recordings[0].name if len(recordings) == 1 else ""
    if total < SHORTEST or (fewest < FEWEST and len(recordings) == 1):
        text = (
            f"{total:.3g} s and {fewest} samples of a channel are too short to tell effects apart"
        )
        found.append(Finding("too_short", name, "", text, "error"))
    for recording in recordings if len(recordings) > 1 else ():
        length = float(recording.end - recording.start)
        fewest = min((c.samples for c in checks if c.recording == recording.name), default=0)
        if length < SHORTEST or fewest < FEWEST:
            text = f"{length:.3g} s and {fewest} samples of a channel are too short to be used"
            found.append(Finding("too_short", recording.name, "", text, "error"))
    if excited.is_dead:
        names = ", ".join(f"`{signal.name}`" for signal in excited.inputs) or "no input"
        text = f"nothing is excited: {names} neither steps nor varies above its noise"
        found.append(Finding("no_excitation", name, "", text, "error"))
    return found
