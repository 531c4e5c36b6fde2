"""Disagreement: what odd relations to the simulation say about signs, units and clocks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from statistics import median

from diagnosis.quality.finding import Finding, Severity
from diagnosis.quality.model_agreement import OutputAgreement
from engine.recordings.recording import Recording
from language.expressions.units import Dimension, are_compatible, parse_unit
from language.loading.recording_map_reader import column_dimension
from language.model.automaton import Automaton
from language.model.system import RecordingMap

OFFSET_ERROR, OFFSET_WARNING = 0.1, 0.08
"""Offsets of clocks [s] that are an error and a warning; actuators and sensors lag up to 0.05."""
SINGLE_RECORDING_MARGIN = 0.1
"""How much better the correlation has to be, to believe that one recording of several is late."""
CLOCK_TOLERANCE = 0.04
"""Lags nearer than this are one offset [s]."""
SHARED_FRACTION = 0.6
"""Share of the recordings from which a mistake is that of all of them."""
MAX_SCALE_RATIO = 2.5
"""Ratio of measured to simulated above which, or below whose inverse, the scale is told."""
FACTOR_TOLERANCE = 0.3
"""Relative distance from a factor of units; parameters of a naive model are 20 per cent wrong."""
SHARED_FACTOR_TOLERANCE = 0.5
"""The same where all outputs are off alike: what the model lacks seldom does that."""
UNIT_FACTORS: Sequence[tuple[float, str, str]] = (
    (30.0 / math.pi, "rad/s", "rpm taken for rad/s"),
    (math.pi / 30.0, "rad/s", "rad/s taken for rpm"),
    (3.6, "m/s", "km/h taken for m/s"),
    (1.0 / 3.6, "m/s", "m/s taken for km/h"),
    (180.0 / math.pi, "rad", "deg taken for rad"),
    (math.pi / 180.0, "rad", "rad taken for deg"),
    (180.0 / math.pi, "rad/s", "deg/s taken for rad/s"),
    (1000.0, "", "a unit a thousand times smaller than the map says"),
    (1.0e-3, "", "a unit a thousand times larger than the map says"),
)
"""A factor between measured and simulated, where it can occur, and what it comes from."""


def find_unit_sign_clock_errors(
    agreements: Sequence[OutputAgreement],
    automaton: Automaton,
    mapping: RecordingMap,
    recordings: Sequence[Recording],
) -> list[Finding]:
    """Return what is to be told of the signs, units and clocks of each recording."""
    own = {
        recording.name: _find_errors(
            recording.name,
            [agreement for agreement in agreements if agreement.recording == recording.name],
            automaton,
            mapping,
            [recording],
        )
        for recording in recordings
    }
    clear = {agreement.recording for agreement in agreements if agreement.is_clear}
    if len(clear) < 2:
        return [finding for findings in own.values() for finding in findings]
    shared = [
        finding
        for finding in _find_errors("", agreements, automaton, mapping, recordings)
        if _is_shared(finding, own, agreements)
    ]
    outputs = {agreement.channel for agreement in agreements}
    reported_kinds = {
        kind for f in shared if f.channel not in outputs for kind in _similar_kinds(f.kind)
    }
    rest = [
        f
        for fs in own.values()
        for f in fs
        if not _has_similar(shared, f) and f.kind not in reported_kinds
    ]
    units = [f for findings in own.values() for f in findings if f.kind == "unit"]
    if 2 * len({f.recording for f in units}) >= len(recordings):
        units = [f for f in shared if f.kind == "unit"] or units
        return units  # single recordings say which unit it is
    if any(finding.kind != "clock_offset" for finding in shared):
        return shared  # what else is odd follows from that
    sure = {
        r.recording
        for r in agreements
        if r.is_clear and r.correlation_gain > SINGLE_RECORDING_MARGIN
    }
    return [
        *shared,
        *[
            _weaken_clock_finding(f)
            for f in rest
            if f.kind != "clock_offset" or f.recording in sure
        ],
    ]


def agrees_with_other_outputs(finding: Finding, agreements: Sequence[OutputAgreement]) -> bool:
    """Tell whether an output is as large as others say that go with the model.

    What the model lacks may shake one output many times as much as it does the simulated one; in
    another unit it would be as far from all others.
    """
    if finding.kind not in ("unit", "scale"):
        return False
    here = [r for r in agreements if finding.recording in ("", r.recording)]
    own = [r.level for r in here if r.channel == finding.channel]
    right = [r for r in here if r.is_clear and 1.0 / MAX_SCALE_RATIO < r.gain < MAX_SCALE_RATIO]
    others = [r.level for r in right if r.channel != finding.channel]
    if not own or not others or not min(*own, *others) > 0.0:
        return False
    return abs(math.log(median(own) / median(others))) < math.log(1.0 + FACTOR_TOLERANCE)


def _is_shared(
    finding: Finding,
    by_recording: Mapping[str, Sequence[Finding]],
    agreements: Sequence[OutputAgreement],
) -> bool:
    """Tell whether most recordings say the same, of those in which the channel is clear."""
    clear = {r.recording for r in agreements if r.is_clear and r.channel == finding.channel}
    count = sum(_has_similar(findings, finding) for findings in by_recording.values())
    if not clear:  # an input: where one output alone is clear, that one is blamed
        clear = {r.recording for r in agreements if r.is_clear}
        kinds = _similar_kinds(finding.kind)
        count = sum(any(f.kind in kinds for f in findings) for findings in by_recording.values())
    return count >= 2 and count > SHARED_FRACTION * len(clear)


def _weaken_clock_finding(finding: Finding) -> Finding:
    """A clock that is off in some recordings alone may be an actuator that is slow in these."""
    if finding.kind != "clock_offset":
        return finding
    return replace(finding, severity="warning")


def _has_similar(findings: Sequence[Finding], finding: Finding) -> bool:
    return any(
        f.channel == finding.channel and f.kind in _similar_kinds(finding.kind) for f in findings
    )


def _similar_kinds(kind: str) -> tuple[str, ...]:
    return ("unit", "scale") if kind in ("unit", "scale") else (kind,)


def _find_errors(
    name: str,
    agreements: Sequence[OutputAgreement],
    automaton: Automaton,
    mapping: RecordingMap,
    recordings: Sequence[Recording],
) -> list[Finding]:
    """Return what the relations of one recording or of all say; clocks if all else is right."""
    clear = [agreement for agreement in agreements if agreement.is_clear]
    by_channel = {
        channel: [r for r in clear if r.channel == channel]
        for channel in dict.fromkeys(r.channel for r in clear)
    }
    if not by_channel:
        return []
    one = _AgreementsByChannel(name, recordings, automaton, mapping, by_channel)
    return [*one.find_sign_errors(), *one.find_unit_errors()] or one.find_clock_errors()


class _AgreementsByChannel:
    """The clear relations of one recording or of all of them, by channel."""

    def __init__(
        self,
        name: str,
        recordings: Sequence[Recording],
        automaton: Automaton,
        mapping: RecordingMap,
        agreements: Mapping[str, Sequence[OutputAgreement]],
    ) -> None:
        self.name = name
        self.mapping = mapping
        self.relations = agreements
        self.gains = {name: median(r.gain for r in rs) for name, rs in agreements.items()}
        self.lags = {name: median(r.significant_lag for r in rs) for name, rs in agreements.items()}
        self.inputs = [
            channel.column.name
            for channel in recordings[0].channels.values()
            if channel.column.to in automaton.inputs
            if any(_varies(recording, channel.column.name) for recording in recordings)
        ]

    def _attribute(self, channels: Sequence[str]) -> tuple[str, str]:
        """Return the channel to blame and how it is called: an input if all outputs are odd."""
        if len(channels) == len(self.gains) and self.inputs:
            if len(channels) > 1:
                return self.inputs[0], f"input `{self.inputs[0]}`"
            return channels[0], f"`{channels[0]}` or input `{self.inputs[0]}`"
        return channels[0], f"`{channels[0]}`"

    def _finding(self, kind: str, channel: str, text: str, severity: Severity) -> Finding:
        return Finding(kind, self.name, channel, text, severity)

    def find_sign_errors(self) -> list[Finding]:
        """Outputs that move against the simulated ones."""
        odd = [name for name, gain in self.gains.items() if gain < 0.0]
        if not odd:
            return []
        groups = [odd] if len(odd) == len(self.gains) else [[name] for name in odd]
        found = []
        for group in groups:
            channel, called = self._attribute(group)
            text = f"{called} has the wrong sign: it moves against what the model gives"
            found.append(self._finding("sign", channel, text, "error"))
        return found

    def find_unit_errors(self) -> list[Finding]:
        """Outputs far larger or smaller than the simulated ones."""
        sizes = {name: abs(gain) for name, gain in self.gains.items()}
        odd = [n for n, size in sizes.items() if not 1.0 / MAX_SCALE_RATIO < size < MAX_SCALE_RATIO]
        if not odd:
            return []
        together = len(odd) == len(sizes) and max(sizes.values()) < 1.6 * min(sizes.values())
        found = []
        for group in [odd] if together else [[name] for name in odd]:
            channel, called = self._attribute(group) if together else (group[0], f"`{group[0]}`")
            if together and channel not in sizes:
                found.append(self._shared_scale_finding(group, channel, called))
                continue
            size = median(sizes[name] for name in group)
            found.append(self._scale_finding(channel, called, size, True))
        return found

    def _shared_scale_finding(self, outputs: Sequence[str], channel: str, subject: str) -> Finding:
        """Tell what makes all outputs too large: an input too small, or a unit that they share."""
        size = median(abs(self.gains[name]) for name in outputs)
        if not _unit_error_reason(1.0 / size, column_dimension(self.mapping.columns[channel])):
            reasons = {
                _unit_error_reason(
                    size, column_dimension(self.mapping.columns[name]), SHARED_FACTOR_TOLERANCE
                )
                for name in outputs
            }
            if len(reasons) == 1 and reasons != {""}:
                both = " and ".join(f"`{name}`" for name in outputs)
                text = f"{both} are {size:.3g} times what the model gives: {reasons.pop()}?"
                return self._finding("unit", outputs[0], text, "error")
        return self._scale_finding(channel, subject, 1.0 / size, False)

    def _scale_finding(self, channel: str, subject: str, size: float, is_output: bool) -> Finding:
        dimension = column_dimension(self.mapping.columns[channel])
        share = f"{size:.3g} times" if size > 1.0 else f"1/{1.0 / size:.3g} of"
        source = _unit_error_reason(size, dimension)
        what = f"{share} what the model {'gives' if is_output else 'needs'}"
        text = f"{subject} is {what}" + (f": {source}?" if source else "")
        if source:
            return self._finding("unit", channel, text, "error")
        return self._finding("scale", channel, text, "warning")

    def find_clock_errors(self) -> list[Finding]:
        """Outputs that lag or lead the simulated ones by more than an actuator or sensor does."""
        odd = [name for name, lag in self.lags.items() if abs(lag) >= OFFSET_WARNING]
        if not odd:
            return []
        lags = [self.lags[name] for name in odd]
        together = len(odd) == len(self.lags) and max(lags) - min(lags) < CLOCK_TOLERANCE
        return [
            self._clock_offset_finding(group, together)
            for group in ([odd] if together else [[n] for n in odd])
        ]

    def _clock_offset_finding(self, channels: Sequence[str], is_shared: bool) -> Finding:
        """Tell whose clock is off; an error if it is so by the same time wherever it is clear."""
        lag = median(self.lags[name] for name in channels)
        channel, called = (
            self._attribute(channels) if is_shared else (channels[0], f"`{channels[0]}`")
        )
        later = (lag > 0.0) == (channel in self.lags)
        text = f"the clock of {called} is {abs(lag):.2f} s {'late' if later else 'early'}"
        if is_shared and len(channels) == 1 and self.inputs:
            text = f"the clocks of `{channels[0]}` and input `{self.inputs[0]}` are {abs(lag):.2f} s apart"
        each = [r.significant_lag for name in channels for r in self.relations[name]]
        steady = sum(abs(one - lag) <= CLOCK_TOLERANCE for one in each) >= SHARED_FRACTION * len(
            each
        )
        is_sure = steady and abs(lag) >= OFFSET_ERROR
        return self._finding("clock_offset", channel, text, "error" if is_sure else "warning")


def _varies(recording: Recording, name: str) -> bool:
    channel = recording.channels.get(name)
    return channel is not None and len(set(channel.values)) > 1


def _unit_error_reason(
    size: float, dimension: Dimension, tolerance: float = FACTOR_TOLERANCE
) -> str:
    """Return what makes a channel `size` times as large as it should be; empty if not known."""
    near = [
        (abs(math.log(size / factor)), reason)
        for factor, unit, reason in UNIT_FACTORS
        if not unit or are_compatible(parse_unit(unit).dimension, dimension)
    ]
    distance, reason = min(near)
    return reason if distance < math.log(1.0 + tolerance) else ""
