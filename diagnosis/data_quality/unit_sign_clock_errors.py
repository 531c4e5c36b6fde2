"""Unit, sign and clock errors: conclusions from the agreement of recordings with a simulation.

Without a model, recorded speeds of one motion are compared with each other.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from statistics import median

import numpy as np

from diagnosis.data_quality.excitation import is_speed
from diagnosis.data_quality.finding import Finding, Severity
from diagnosis.data_quality.model_agreement import (
    GAIN_SMOOTHING_STD,
    OutputAgreement,
    compare_signals,
)
from diagnosis.data_quality.output_comparison import OutputComparison
from engine.recordings.recording import Channel, Recording, split_by_windows
from language.expressions.units import are_compatible, parse_unit
from language.loading.recording_map_reader import column_dimension
from language.model.automaton import Automaton
from language.model.system import RecordingMap

OFFSET_ERROR, OFFSET_WARNING = 0.5, 0.4
"""Clock offsets that are errors and warnings, in reference times.

With a reference time of 0.2 s actuators and sensors have lags up to 0.05 s.
"""
SINGLE_RECORDING_MARGIN = 0.1
"""Increase of the correlation from which a lag in a single recording of several is reported."""
CLOCK_TOLERANCE = 0.2
"""Lags within this distance are the same offset, in reference times."""
SHARED_FRACTION = 0.6
"""Fraction of the recordings from which an error is attributed to all."""
MAX_SCALE_RATIO = 2.5
"""Ratio of measured to simulated above which, or below whose inverse, the scale is reported."""
FACTOR_TOLERANCE = 0.3
"""Relative distance from a factor of units; parameters of a rough model are 20 % wrong."""
SHARED_FACTOR_TOLERANCE = 0.5
"""The same if all outputs have the same factor, which missing physics seldom causes."""
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
"""Factor of measured to simulated, the unit for which it can occur, and its cause."""
MIN_SPEED_CORRELATION = 0.9
"""Correlation of the rates of change from which two speeds are one motion."""
MAX_SPEED_OFFSET = 3.0
"""A larger offset, in reference times, is a period of the motion rather than of the clock."""


def find_unit_sign_clock_errors(
    agreements: Sequence[OutputAgreement],
    automaton: Automaton,
    mapping: RecordingMap,
    recordings: Sequence[Recording],
) -> list[Finding]:
    """Return findings on signs, units and clocks, for all recordings or for single ones.

    With fewer than two clear recordings the findings of each are returned. Else an error that
    `SHARED_FRACTION` of them show is reported once, and hides others unless it is a clock offset.
    If half of the recordings have unit errors, only these are returned. A clock offset of a single
    recording is a warning.
    """
    own = {
        recording.name: _ClearAgreements(
            recording.name,
            [agreement for agreement in agreements if agreement.recording == recording.name],
            automaton,
            mapping,
            [recording],
        ).find_errors()
        for recording in recordings
    }
    single = [finding for findings in own.values() for finding in findings]
    clear = {agreement.recording for agreement in agreements if agreement.is_clear}
    if len(clear) < 2:
        return single
    shared = [
        finding
        for finding in _ClearAgreements(
            "", agreements, automaton, mapping, recordings
        ).find_errors()
        if _is_shared(finding, own, agreements)
    ]
    units = [f for f in single if f.kind == "unit"]
    if 2 * len({f.recording for f in units}) >= len(recordings):
        return [f for f in shared if f.kind == "unit"] or units  # single ones show which unit
    if any(finding.kind != "clock_offset" for finding in shared):
        return shared  # Other findings are consequences of these.
    outputs = {agreement.channel for agreement in agreements}
    reported = {kind for f in shared if f.channel not in outputs for kind in _similar_kinds(f.kind)}
    rest = [f for f in single if not _has_similar(shared, f) and f.kind not in reported]
    sure = {
        r.recording
        for r in agreements
        if r.is_clear and r.correlation_gain > SINGLE_RECORDING_MARGIN
    }
    found = list(shared)
    for finding in rest:
        if finding.kind != "clock_offset":
            found.append(finding)
        elif finding.recording in sure:  # In a single recording an actuator may be slow instead.
            found.append(replace(finding, severity="warning"))
    return found


def agrees_with_other_outputs(finding: Finding, agreements: Sequence[OutputAgreement]) -> bool:
    """Return whether a unit or scale finding is refuted by the level of the other outputs.

    Missing physics can make one output oscillate much more than in the simulation, which looks like
    a scale error; a wrong unit would change its level relative to the others.
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
    """Return whether most recordings with a clear agreement of the channel have this finding."""
    clear = {r.recording for r in agreements if r.is_clear and r.channel == finding.channel}
    count = sum(_has_similar(findings, finding) for findings in by_recording.values())
    if not clear:  # An input: if one output alone is clear, the finding names that output.
        clear = {r.recording for r in agreements if r.is_clear}
        kinds = _similar_kinds(finding.kind)
        count = sum(any(f.kind in kinds for f in findings) for findings in by_recording.values())
    return count >= 2 and count > SHARED_FRACTION * len(clear)


def _has_similar(findings: Sequence[Finding], finding: Finding) -> bool:
    """Return whether findings contain one of a similar kind on the same channel."""
    return any(
        f.channel == finding.channel and f.kind in _similar_kinds(finding.kind) for f in findings
    )


def _similar_kinds(kind: str) -> tuple[str, ...]:
    """Return the kinds that describe the same error: unit and scale, or the kind itself."""
    return ("unit", "scale") if kind in ("unit", "scale") else (kind,)


class _ClearAgreements:
    """The clear agreements of one recording, or of all of them for an empty name, by channel."""

    def __init__(
        self,
        name: str,
        agreements: Sequence[OutputAgreement],
        automaton: Automaton,
        mapping: RecordingMap,
        recordings: Sequence[Recording],
    ) -> None:
        by_channel: dict[str, list[OutputAgreement]] = {}
        for agreement in agreements:
            if agreement.is_clear:
                by_channel.setdefault(agreement.channel, []).append(agreement)
        self.name = name
        self.mapping = mapping
        self.relations = by_channel
        self.gains = {name: median(r.gain for r in rs) for name, rs in by_channel.items()}
        self.lags = {name: median(r.significant_lag for r in rs) for name, rs in by_channel.items()}
        times = [r.reference_time for rs in by_channel.values() for r in rs]
        self.reference_time = median(times) if times else math.inf
        self.inputs = [
            channel.column.name
            for channel in recordings[0].channels.values()
            if channel.column.to in automaton.inputs
            if any(_varies(recording, channel.column.name) for recording in recordings)
        ]

    def find_errors(self) -> list[Finding]:
        """Return sign and unit errors, or clock errors if there are none."""
        return [*self.find_sign_errors(), *self.find_unit_errors()] or self.find_clock_errors()

    def _attribute(self, channels: Sequence[str]) -> tuple[str, str]:
        """Return the channel to report and its name: an input if all outputs are affected."""
        if len(channels) == len(self.gains) and self.inputs:
            if len(channels) > 1:
                return self.inputs[0], f"input `{self.inputs[0]}`"
            return channels[0], f"`{channels[0]}` or input `{self.inputs[0]}`"
        return channels[0], f"`{channels[0]}`"

    def find_sign_errors(self) -> list[Finding]:
        """Return errors for outputs with a negative gain; one for the input if all are negative."""
        odd = [name for name, gain in self.gains.items() if gain < 0.0]
        text = "has the wrong sign: it moves against what the model gives"
        found = [self._attribute(group) for group in _groups(odd, len(odd) == len(self.gains))]
        return [Finding("sign", self.name, one, f"{name} {text}", "error") for one, name in found]

    def find_unit_errors(self) -> list[Finding]:
        """Return findings on outputs much larger or smaller than the simulated ones."""
        sizes = {name: abs(gain) for name, gain in self.gains.items()}
        odd = [n for n, size in sizes.items() if not 1.0 / MAX_SCALE_RATIO < size < MAX_SCALE_RATIO]
        is_all = len(odd) == len(sizes)
        together = bool(odd) and is_all and max(sizes.values()) < 1.6 * min(sizes.values())
        found = []
        for group in _groups(odd, together):
            channel, called = self._attribute(group)
            if channel in sizes:
                size = median(sizes[name] for name in group)
                found.append(self._scale_finding(channel, called, size, True))
            else:
                found.append(self._shared_scale_finding(group, channel, called))
        return found

    def _shared_scale_finding(self, outputs: Sequence[str], channel: str, subject: str) -> Finding:
        """Return the finding on all outputs: a scale of the input or a shared unit."""
        size = median(abs(self.gains[name]) for name in outputs)
        if not self._unit_error_reason(channel, 1.0 / size):
            reasons = {
                self._unit_error_reason(name, size, SHARED_FACTOR_TOLERANCE) for name in outputs
            }
            if len(reasons) == 1 and reasons != {""}:
                both = " and ".join(f"`{name}`" for name in outputs)
                text = f"{both} are {size:.3g} times what the model gives: {reasons.pop()}?"
                return Finding("unit", self.name, outputs[0], text, "error")
        return self._scale_finding(channel, subject, 1.0 / size, False)

    def _scale_finding(self, channel: str, subject: str, size: float, is_output: bool) -> Finding:
        """Return a unit error if a factor explains the size, else a scale warning."""
        share = f"{size:.3g} times" if size > 1.0 else f"1/{1.0 / size:.3g} of"
        text = f"{subject} is {share} what the model {'gives' if is_output else 'needs'}"
        source = self._unit_error_reason(channel, size)
        if source:
            return Finding("unit", self.name, channel, f"{text}: {source}?", "error")
        return Finding("scale", self.name, channel, text, "warning")

    def _unit_error_reason(
        self, channel: str, size: float, tolerance: float = FACTOR_TOLERANCE
    ) -> str:
        """Return the unit error that explains a ratio of measured to simulated, or ""."""
        dimension = column_dimension(self.mapping.columns[channel])
        distance, reason = min(
            (abs(math.log(size / factor)), reason)
            for factor, unit, reason in UNIT_FACTORS
            if not unit or are_compatible(parse_unit(unit).dimension, dimension)
        )
        return reason if distance < math.log(1.0 + tolerance) else ""

    def find_clock_errors(self) -> list[Finding]:
        """Return findings on outputs with a larger lag than actuators and sensors have."""
        odd = {
            n: lag
            for n, lag in self.lags.items()
            if abs(lag) >= OFFSET_WARNING * self.reference_time
        }
        spread = max(odd.values()) - min(odd.values()) if odd else math.inf
        is_one = spread < CLOCK_TOLERANCE * self.reference_time
        groups = _groups(list(odd), is_one and len(odd) == len(self.lags))
        return [self._clock_offset_finding(group) for group in groups]

    def _clock_offset_finding(self, channels: Sequence[str]) -> Finding:
        """Return the clock finding on channels: an error if most agreements have the same lag."""
        lag = median(self.lags[name] for name in channels)
        channel, called = self._attribute(channels)
        later = (lag > 0.0) == (channel in self.lags)
        text = f"the clock of {called} is {abs(lag):.2f} s {'late' if later else 'early'}"
        if len(channels) == len(self.lags) == 1 and self.inputs:
            both = f"`{channels[0]}` and input `{self.inputs[0]}`"
            text = f"the clocks of {both} are {abs(lag):.2f} s apart"
        each = [r.significant_lag for name in channels for r in self.relations[name]]
        near = sum(abs(one - lag) <= CLOCK_TOLERANCE * self.reference_time for one in each)
        is_sure = (
            near >= SHARED_FRACTION * len(each) and abs(lag) >= OFFSET_ERROR * self.reference_time
        )
        severity: Severity = "error" if is_sure else "warning"
        return Finding("clock_offset", self.name, channel, text, severity)


def _groups(names: Sequence[str], is_one: bool) -> list[Sequence[str]]:
    """Return names as one group or as groups of one name each; none without names."""
    return [names] if names and is_one else [[name] for name in names]


def _varies(recording: Recording, name: str) -> bool:
    """Return whether a channel is recorded and not constant."""
    channel = recording.channels.get(name)
    return channel is not None and len(set(channel.values)) > 1


def find_redundant_speeds(recordings: Sequence[Recording]) -> list[Finding]:
    """Return findings on pairs of speeds that agree except for a sign or a clock offset.

    Speeds agree from `MIN_SPEED_CORRELATION` on, in the longest window of a recording. A finding
    needs `SHARED_FRACTION` of these recordings; it is a warning if there is one only.
    """
    found: dict[tuple[str, str], list[OutputAgreement]] = {}
    for recording in recordings:
        speeds = [channel for channel in recording.channels.values() if is_speed(channel)]
        for first, second in itertools.combinations(speeds, 2):
            agreement = _compare_speeds(recording, first, second)
            if agreement is not None and abs(agreement.correlation) >= MIN_SPEED_CORRELATION:
                key = first.column.name, second.column.name
                found.setdefault(key, []).append(agreement)
    return [
        finding for pair, each in found.items() for finding in _redundancy_findings(*pair, each)
    ]


def _compare_speeds(
    recording: Recording, first: Channel, second: Channel
) -> OutputAgreement | None:
    """Return the agreement of two speeds in the longest window; None if they hardly overlap."""
    piece = max(split_by_windows(recording), key=lambda piece: piece.end - piece.start)
    one = piece.channels.get(first.column.name)
    other = piece.channels.get(second.column.name)
    if one is None or other is None:
        return None
    inside = (other.seconds >= one.seconds[0]) & (other.seconds <= one.seconds[-1])
    if inside.sum() < 2:
        return None
    times = other.seconds[inside]
    same = np.interp(times, one.seconds, one.array)
    compared = OutputComparison(times, other.array[inside], same)
    return compare_signals(recording.name, other.column.name, compared, GAIN_SMOOTHING_STD)


def _redundancy_findings(
    first: str, second: str, agreements: Sequence[OutputAgreement]
) -> list[Finding]:
    """Return the finding on a pair of speeds, if most recordings agree on a sign or an offset."""
    both = f"`{first}` and `{second}` are one motion"
    severity: Severity = "error" if len(agreements) > 1 else "warning"
    where = agreements[0].recording if len(agreements) == 1 else ""
    if sum(agreement.gain < 0.0 for agreement in agreements) > SHARED_FRACTION * len(agreements):
        return [Finding("sign", where, second, f"{both} with opposite signs", severity)]
    lag = median(agreement.significant_lag for agreement in agreements)
    time = median(agreement.reference_time for agreement in agreements)
    near = CLOCK_TOLERANCE * time
    same = sum(abs(agreement.significant_lag - lag) <= near for agreement in agreements)
    is_offset = OFFSET_WARNING * time <= abs(lag) <= MAX_SPEED_OFFSET * time
    if is_offset and same > SHARED_FRACTION * len(agreements):
        late = second if lag > 0.0 else first
        text = f"{both}, but the clock of `{late}` is {abs(lag):.2f} s late"
        return [Finding("clock_offset", where, late, text, severity)]
    return []
