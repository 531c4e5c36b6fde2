"""Recording check: what recorded data are worth, before anything is concluded from them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from diagnosis.alike import alike
from diagnosis.channel_check import ChannelCheck, check_channel, findings_of
from diagnosis.consistency import Relation, relations
from diagnosis.disagreement import disagreements
from diagnosis.excitation import Excitation, excitation
from diagnosis.finding import Finding, by_severity
from engine.interpreter import Interpreter, Stepper
from engine.recording import Recording, pieces
from language.experiment import RecordingMap
from language.model import Automaton
from language.program import Program

SHORTEST = 2.0
"""Time of all recordings together below which nothing can be told apart [s]."""
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
    build: Callable[[Program], Stepper] = Interpreter,
) -> RecordingCheck:
    """Return what is to be known of recordings; with an automaton also units, signs and clocks."""
    channels, findings = [], []
    for recording in recordings:
        for channel in recording.channels.values():
            check = check_channel(recording, channel)
            channels.append(check)
            findings += findings_of(check, channel.column.compare is not None)
    excited = excitation(recordings, channels)
    if automaton is not None:
        findings += _missing_inputs(recordings, automaton)
    findings += _too_little(recordings, channels, excited)
    found: list[Relation] = []
    lacks = any(finding.kind == "no_signal" for finding in findings)
    if automaton is None and not lacks:
        findings += alike(recordings)
    if automaton is not None and automaton.period is None and not lacks:
        found = relations(recordings, mapping, automaton, build)
        findings += disagreements(found, automaton, mapping, recordings)
    return RecordingCheck(tuple(channels), by_severity(findings), excited, tuple(found))


def _missing_inputs(recordings: Sequence[Recording], automaton: Automaton) -> list[Finding]:
    """Inputs without a default that have one value in all recordings: nothing drives the model."""
    values: dict[str, set[float]] = {}
    for recording in recordings:
        for name, channel in recording.channels.items():
            thing = automaton.inputs.get(channel.column.to or "")
            if thing is not None and thing.default is None:
                values.setdefault(name, set()).update(channel.values)
    return [
        Finding(
            "no_signal", "", name, f"is {min(found):g} all the time: the signal is missing", "error"
        )
        for name, found in values.items()
        if len(found) == 1
    ]


def _too_little(
    recordings: Sequence[Recording], checks: Sequence[ChannelCheck], excited: Excitation
) -> list[Finding]:
    found = []
    total = sum(float(p.end - p.start) for recording in recordings for p in pieces(recording))
    fewest = min((check.samples for check in checks), default=0)
    name = recordings[0].name if len(recordings) == 1 else ""
    if total < SHORTEST or fewest < FEWEST:
        text = (
            f"{total:.3g} s and {fewest} samples of a channel are too short to tell effects apart"
        )
        found.append(Finding("too_short", name, "", text, "error"))
    if excited.is_dead:
        names = ", ".join(f"`{signal.name}`" for signal in excited.inputs) or "no input"
        text = f"nothing is excited: {names} neither steps nor varies above its noise"
        found.append(Finding("no_excitation", name, "", text, "error"))
    return found
