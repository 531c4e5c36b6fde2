"""Unit correction: another unit of a column, or exchanged columns, tested by a simulation."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.data_quality.finding import Finding
from diagnosis.data_quality.model_agreement import (
    MIN_PIECE,
    OutputAgreement,
    compare_with_simulation,
    most_excited_piece,
    recording_reference_time,
)
from diagnosis.data_quality.output_comparison import ReferenceModel
from diagnosis.data_quality.unit_sign_clock_errors import SHARED_FRACTION, UNIT_FACTORS
from engine.recordings.recording import Channel, Recording, split_by_windows
from language.expressions.units import are_compatible, parse_unit
from language.loading.recording_map_reader import column_dimension
from language.model.automaton import Automaton
from language.model.system import ColumnMapping
from language.text.diagnostic import SpecError

MAX_CONSISTENT_GAIN = 1.6
"""Gains between this and its inverse are explained by wrong parameters."""
TESTED_FACTORS = (
    *UNIT_FACTORS,
    (2.0 * math.pi, "rad/s", "rad/s taken for revolutions per second"),
    (0.5 / math.pi, "rad/s", "revolutions per second taken for rad/s"),
)
"""Factors as in `UNIT_FACTORS`, with some that only a simulation can separate from others."""
MIN_DISTANCE = 0.7
"""Smallest distance from the model (the logarithm of a gain of 2) that a correction must remove."""
MAX_GAIN = 6.0
"""Largest gain of an output, or of its inverse, after a correction of its unit.

A simulation that starts with a speed in a wrong unit has large errors.
"""
SURE_CORRELATION = 0.9
"""Correlation above which the unit that follows from the gain needs no simulation."""
MAX_SAMPLE_TIME, MAX_SAMPLE_STEPS = 0.5, 200
"""Sample period [s] and number of model steps from which a time in milliseconds is tested."""
MAX_TESTED_RECORDINGS = 3
"""Number of inconsistent recordings in which corrections are tested."""


@dataclass(frozen=True)
class ColumnCorrection:
    """A correction: a column divided by `factor`, or exchanged with the column `other`."""

    column: str
    factor: float = 1.0
    other: str = ""
    reason: str = ""

    def apply(self, recording: Recording) -> Recording:
        """Return a recording with the correction applied; KeyError without the column."""
        channels = dict(recording.channels)
        one = channels[self.column]
        if self.other:
            two = channels[self.other]
            channels[self.column] = Channel(one.column, two.times, two.values)
            channels[self.other] = Channel(two.column, one.times, one.values)
        else:
            values = tuple((one.array / self.factor).tolist())
            channels[self.column] = Channel(one.column, one.times, values)
        return dataclasses.replace(recording, channels=channels)

    def to_finding(self, recording: str) -> Finding:
        """Return the error `swap` or `unit` on a recording, or on all of them for an empty name."""
        if self.other:
            text = f"`{self.column}` and `{self.other}` are exchanged: they go with the model "
            return Finding("swap", recording, self.column, text + "the other way round", "error")
        share = f"{self.factor:.3g} times" if self.factor > 1.0 else f"1/{1.0 / self.factor:.3g} of"
        text = f"`{self.column}` is {share} what goes with the model: {self.reason}?"
        return Finding("unit", recording, self.column, text, "error")


def find_corrections(
    agreements: Sequence[OutputAgreement],
    recordings: Sequence[Recording],
    reference: ReferenceModel,
    findings: Sequence[Finding] = (),
) -> list[Finding]:
    """Return findings on corrections of recordings that do not agree with the model.

    The `MAX_TESTED_RECORDINGS` (3) of largest distance are simulated with each possible correction;
    the nearest one that makes all outputs agree is taken. A unit error in `findings` is kept if all
    outputs correlate by `SURE_CORRELATION`. A correction that all have is reported once.
    """
    by_name = {one.name: [r for r in agreements if r.recording == one.name] for one in recordings}
    by_name = {
        name: each
        for name, each in by_name.items()
        if any(_is_inconsistent(r) for r in each)
        and not (
            any(f.kind == "unit" and f.recording in ("", name) for f in findings)
            and all(abs(r.correlation) > SURE_CORRELATION for r in each)
        )
    }
    distances = {name: max(_distance(r) for r in each) for name, each in by_name.items()}
    inconsistent = [one for one in recordings if one.name in distances]
    inconsistent.sort(key=lambda one: -distances[one.name])
    corrections: dict[str, ColumnCorrection] = {}
    for recording in inconsistent[:MAX_TESTED_RECORDINGS]:
        part = _shortest_piece(recording)
        most = distances[recording.name] - MIN_DISTANCE
        best = _best_correction(part, list(dict.fromkeys(corrections.values())), most, reference)
        possible = _candidate_corrections(recording, reference.automaton, by_name[recording.name])
        best = best or _best_correction(part, possible, most, reference)
        if best is not None:
            corrections[recording.name] = best
    distinct = set(corrections.values())
    least = max(2.0, SHARED_FRACTION * len(recordings))
    if len(distinct) == 1 and len(corrections) > 1 and len(inconsistent) >= least:
        return [distinct.pop().to_finding("")]
    return [correction.to_finding(name) for name, correction in corrections.items()]


def _shortest_piece(recording: Recording) -> Recording:
    """Return the most excited part of the first window, as short as can be compared."""
    piece = split_by_windows(recording)[0]
    return most_excited_piece(piece, MIN_PIECE * recording_reference_time(piece))


def find_millisecond_time(recording: Recording, reference: ReferenceModel) -> list[Finding]:
    """Return a finding if the time of a recording may be in milliseconds, else an empty list.

    It is an error if all outputs agree after a division by 1000, else a warning.
    """
    channels = [one for one in recording.channels.values() if len(one.times) > 1]
    usual = min((float(np.median(np.diff(one.seconds))) for one in channels), default=0.0)
    steps = usual / float(reference.automaton.step)
    if usual < MAX_SAMPLE_TIME or steps < MAX_SAMPLE_STEPS:
        return []
    name = reference.automaton.name
    text = f"a sample each {usual:.4g} s is one in {steps:.4g} steps of `{name}`"
    try:
        part = _shortest_piece(_scale_time(recording))
        after = compare_with_simulation([part], reference)
    except (SpecError, ArithmeticError):
        after = []
    is_sure = bool(after) and all(_is_consistent(agreement) for agreement in after)
    text += ": is the time in ms?" + (" Then it goes with the model" if is_sure else "")
    return [Finding("time", recording.name, "", text, "error" if is_sure else "warning")]


def _scale_time(recording: Recording) -> Recording:
    """Return a recording with its time divided by 1000, without windows."""
    channels = {
        name: Channel(one.column, tuple(time / 1000 for time in one.times), one.values)
        for name, one in recording.channels.items()
    }
    return Recording(recording.name, channels, recording.end / 1000, recording.start / 1000)


def _best_correction(
    recording: Recording,
    corrections: Sequence[ColumnCorrection],
    max_distance: float,
    reference: ReferenceModel,
) -> ColumnCorrection | None:
    """Return the nearest correction within `max_distance` that makes all outputs agree, if any."""
    distances = {}
    for correction in corrections:
        try:
            after = compare_with_simulation([correction.apply(recording)], reference)
        except (SpecError, ArithmeticError):
            continue
        if after and all(_is_consistent(agreement) for agreement in after):
            distances[correction] = max(_distance(agreement) for agreement in after)
    near = [one for one, distance in distances.items() if distance < max_distance]
    return min(near, key=lambda one: distances[one], default=None)


def _candidate_corrections(
    recording: Recording, automaton: Automaton, agreements: Sequence[OutputAgreement]
) -> list[ColumnCorrection]:
    """Return the corrections that fit the dimensions and leave gains below `MAX_GAIN`."""
    gains = {agreement.channel: agreement.gain for agreement in agreements}
    used = {
        name: channel.column
        for name, channel in recording.channels.items()
        if channel.column.to in automaton.inputs or channel.column.compare in automaton.outputs
    }
    found = [
        ColumnCorrection(name, factor, reason=_reason_with_unit(reason, column))
        for name, column in used.items()
        for factor, unit, reason in TESTED_FACTORS
        if not unit or are_compatible(parse_unit(unit).dimension, column_dimension(column))
        if abs(math.log(abs(gains.get(name, factor)) / factor)) < math.log(MAX_GAIN)
    ]
    found += [
        ColumnCorrection(one, other=two)
        for one, two in itertools.combinations(used, 2)
        if column_dimension(used[one]) == column_dimension(used[two])
        and (used[one].to is None) == (used[two].to is None)
    ]
    return found


def _reason_with_unit(reason: str, column: ColumnMapping) -> str:
    """Return a reason with the likely unit added to a factor of a thousand."""
    text = column.unit.text
    if "thousand times larger" in reason and not text.startswith("k"):
        return f"{reason}, as k{text} taken for {text}"
    return reason


def _is_inconsistent(agreement: OutputAgreement) -> bool:
    """Return whether an output disagrees with the model apart from its sign."""
    return abs(math.log(abs(agreement.gain))) + 1.0 - abs(agreement.correlation) > MIN_DISTANCE


def _is_consistent(agreement: OutputAgreement) -> bool:
    """Return whether an output agrees with the model but for its parameters."""
    return agreement.is_clear and 1.0 / MAX_CONSISTENT_GAIN < agreement.gain < MAX_CONSISTENT_GAIN


def _distance(agreement: OutputAgreement) -> float:
    """Return the distance of an output from the model: |log gain| + 1 - correlation."""
    return abs(math.log(abs(agreement.gain))) + 1.0 - max(agreement.correlation, 0.0)


def replace_corrected(findings: Sequence[Finding], corrections: Sequence[Finding]) -> list[Finding]:
    """Return findings with corrections in place of other findings on the same recordings.

    A unit correction beside a unit finding is dropped; one of all recordings ("") replaces all.
    """
    same = {(f.channel, f.recording) for f in findings if f.kind == "unit"}
    new = [f for f in corrections if f.kind != "unit" or (f.channel, f.recording) not in same]
    where = {f.recording for f in new}
    if "" in where:
        return new
    return [*(f for f in findings if f.recording not in where), *new]
