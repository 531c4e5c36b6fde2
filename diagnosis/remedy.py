"""Remedy: another unit of a column, or two columns exchanged, with which a recording goes with the
model that does not go with it as it is. Each is tried: the model is run with what it makes.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.consistency import SHORTEST_PIECE, Relation, lively, relations
from diagnosis.disagreement import FACTORS, MOST
from diagnosis.finding import Finding
from diagnosis.reference import Reference
from engine.recording import Channel, Recording, pieces
from language.experiment import Column
from language.map import column_dimension
from language.model import Automaton
from language.problem import SpecError
from language.units import fits, parse_unit

NEAR_ONE = 1.6
"""Gains between this and its inverse are those of a model that is right but for its parameters."""
FACTORS_TRIED = (
    *FACTORS,
    (2.0 * math.pi, "rad/s", "rad/s taken for revolutions per second"),
    (0.5 / math.pi, "rad/s", "revolutions per second taken for rad/s"),
)
"""Factors as in `FACTORS`; some of these are too near to others to be told without a trial."""
FAR = 0.7
"""Distance from the model (the logarithm of a gain of 2) that a remedy has to make up for."""
LARGEST_GAIN = 6.0
"""Gains that an output may have, or their inverse, once its unit is right: a simulation that starts
with a speed in a wrong unit is a wild one."""
SURE = 0.9
"""Correlation from which what the gain says of a unit needs no trial."""
LONGEST_STEP, MOST_STEPS = 0.5, 200
"""Seconds between samples, and steps of the model, from which milliseconds are tried."""
MOST_TRIED = 3
"""Recordings of those that do not go with the model in which remedies are tried."""


@dataclass(frozen=True)
class Remedy:
    """A column divided by `factor`, or exchanged with `other`."""

    column: str
    factor: float = 1.0
    other: str = ""
    reason: str = ""

    def of(self, recording: Recording) -> Recording:
        """Return a recording as it would be without the mistake."""
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

    def finding(self, recording: str) -> Finding:
        """Return what is told of a recording, or of all if it is called ""."""
        if self.other:
            text = f"`{self.column}` and `{self.other}` are exchanged: they go with the model "
            return Finding("swap", recording, self.column, text + "the other way round", "error")
        share = f"{self.factor:.3g} times" if self.factor > 1.0 else f"1/{1.0 / self.factor:.3g} of"
        text = f"`{self.column}` is {share} what goes with the model: {self.reason}?"
        return Finding("unit", recording, self.column, text, "error")


def remedies(
    found: Sequence[Relation],
    recordings: Sequence[Recording],
    reference: Reference,
    known: Sequence[Finding] = (),
) -> list[Finding]:
    """Return the remedies of recordings that do not go with the model as they are.

    Where a unit is `known` and all goes with the model but for it, none is tried.
    """
    by_name = {one.name: [r for r in found if r.recording == one.name] for one in recordings}
    sure = {
        name
        for f in known
        if f.kind == "unit"
        for name in ([f.recording] if f.recording else by_name)
    }
    odd = [
        one
        for one in recordings
        if any(_is_odd(r) for r in by_name[one.name])
        and not (one.name in sure and all(abs(r.correlation) > SURE for r in by_name[one.name]))
    ]
    odd = sorted(odd, key=lambda one: -max(_distance(r) for r in by_name[one.name]))
    told: dict[str, Remedy] = {}
    for recording in odd[:MOST_TRIED]:
        part = lively(pieces(recording)[0], SHORTEST_PIECE)
        most = max(_distance(r) for r in by_name[recording.name]) - FAR
        best = _best(part, list(dict.fromkeys(told.values())), most, reference)
        possible = _possible(recording, reference.automaton, by_name[recording.name])
        best = best or _best(part, possible, most, reference)
        if best is not None:
            told[recording.name] = best
    alike = set(told.values())
    if len(alike) == 1 and len(odd) >= max(2.0, MOST * len(recordings)) and len(told) > 1:
        return [alike.pop().finding("")]
    return [remedy.finding(name) for name, remedy in told.items()]


def milliseconds(recording: Recording, reference: Reference) -> list[Finding]:
    """Return whether the time of a recording is one of milliseconds.

    That is sure where the recording then goes with the model; else it is asked.
    """
    usual = min(
        (
            float(np.median(np.diff(one.seconds)))
            for one in recording.channels.values()
            if len(one.times) > 1
        ),
        default=0.0,
    )
    steps = usual / float(reference.automaton.step)
    if usual < LONGEST_STEP or steps < MOST_STEPS:
        return []
    text = (
        f"a sample each {usual:.4g} s is one in {steps:.4g} steps of `{reference.automaton.name}`"
    )
    try:
        part = lively(pieces(_faster(recording))[0], SHORTEST_PIECE)
        after = relations([part], reference)
    except (SpecError, ArithmeticError):
        after = []
    is_sure = bool(after) and all(_is_right(relation) for relation in after)
    text += ": is the time in ms?" + (" Then it goes with the model" if is_sure else "")
    return [Finding("time", recording.name, "", text, "error" if is_sure else "warning")]


def _faster(recording: Recording) -> Recording:
    """Return a recording a thousand times as fast, without the windows of its map."""
    channels = {
        name: Channel(one.column, tuple(time / 1000 for time in one.times), one.values)
        for name, one in recording.channels.items()
    }
    return Recording(recording.name, channels, recording.end / 1000, recording.start / 1000)


def _best(
    recording: Recording,
    possible: Sequence[Remedy],
    most: float,
    reference: Reference,
) -> Remedy | None:
    """Return the remedy after which all outputs go with the model; the one nearest to it."""
    distances = {}
    for remedy in possible:
        try:
            after = relations([remedy.of(recording)], reference)
        except (SpecError, ArithmeticError):
            continue
        if after and all(_is_right(relation) for relation in after):
            distances[remedy] = max(_distance(relation) for relation in after)
    near = [one for one, distance in distances.items() if distance < most]
    return min(near, key=lambda one: distances[one], default=None)


def _possible(
    recording: Recording, automaton: Automaton, known: Sequence[Relation]
) -> list[Remedy]:
    """Return what can be tried with the columns that are used.

    Of an output it is `known` about how large it is: a factor that does not make up for that is
    not tried.
    """
    gains = {relation.channel: relation.gain for relation in known}
    used = {
        name: channel.column
        for name, channel in recording.channels.items()
        if channel.column.to in automaton.inputs or channel.column.compare in automaton.outputs
    }
    found = [
        Remedy(name, factor, reason=_named(reason, column))
        for name, column in used.items()
        for factor, unit, reason in FACTORS_TRIED
        if not unit or fits(parse_unit(unit).dimension, column_dimension(column))
        if abs(math.log(abs(gains.get(name, factor)) / factor)) < math.log(LARGEST_GAIN)
    ]
    found += [
        Remedy(one, other=two)
        for one, two in itertools.combinations(used, 2)
        if column_dimension(used[one]) == column_dimension(used[two])
        and (used[one].to is None) == (used[two].to is None)
    ]
    return found


def _named(reason: str, column: Column) -> str:
    """Return a reason with the unit that it may be."""
    text = column.unit.text
    if "thousand times larger" in reason and not text.startswith("k"):
        return f"{reason}, as k{text} taken for {text}"
    return reason


def _is_odd(relation: Relation) -> bool:
    """Tell whether an output does not go with the model, but for its sign."""
    return abs(math.log(abs(relation.gain))) + 1.0 - abs(relation.correlation) > FAR


def _is_right(relation: Relation) -> bool:
    return relation.is_clear and 1.0 / NEAR_ONE < relation.gain < NEAR_ONE


def _distance(relation: Relation) -> float:
    """Return how far an output is from what the model gives."""
    return abs(math.log(abs(relation.gain))) + 1.0 - max(relation.correlation, 0.0)


def cured(odd: Sequence[Finding], cures: Sequence[Finding]) -> list[Finding]:
    """Return what is odd in recordings, with remedies in place of what follows from the mistake.

    A unit that was told already of the same column stays as it was told.
    """
    same = {(f.channel, f.recording) for f in odd if f.kind == "unit"}
    new = [
        cure for cure in cures if cure.kind != "unit" or (cure.channel, cure.recording) not in same
    ]
    where = {cure.recording for cure in new}
    if "" in where:
        return list(new)
    return [*[f for f in odd if f.recording not in where], *new]
