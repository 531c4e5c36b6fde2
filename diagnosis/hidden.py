"""Hidden: an unknown force or torque that acts in windows: a brake, a pulse, a hit.

Found as a drift that is let free at a balance (see freedom). It takes no parameters to explain
anything at all: it is named only where it is silent most of the time.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.actor import acting
from diagnosis.adequacy import remembers
from diagnosis.bench import Bench
from diagnosis.estimate import Estimate, looked_at, with_normal
from diagnosis.estimation import followed
from diagnosis.evidence import Evidence, evidence, inflation
from diagnosis.freedom import ALL_LEVELS, SMALL_LEVEL, freed, scanned, with_levels
from diagnosis.layers import Layer, fitting
from diagnosis.level import units_of
from diagnosis.locus import Locus, Unknown, over_time, told
from diagnosis.naming import place_path
from diagnosis.noise import MAD
from diagnosis.point import extended
from diagnosis.search import Tell, Tried
from diagnosis.selection import PART, Selection, selected
from diagnosis.share import counted
from diagnosis.silence import from_silence
from diagnosis.stirring import resting, stirring
from diagnosis.threshold import USUAL, Thresholds

Reals = NDArray[np.float64]
MOST = 0.8
"""Part of the squares of a drift that its loudest samples have."""
SHORT = 0.22
"""Part of all samples that these are at most, of what acts in windows."""
KNOWN = 0.6
"""Correlation with something known from which on an input is not hidden: it follows that. A brake
acts where the motor brakes as well: the LEAF's has 0.52."""
STIRRED = 0.4
"""Correlation of its loudness with the movement of known inputs from which on it is an answer."""
RESTING = 0.7
"""Correlation of its loudness with rest from which on it is what a friction lacks."""
NEAR = 0.9
"""Part of what the best place gains that another one gains nearly the same with."""
LITTLE = 0.5
"""Part of what it gains that effects explain less of, if it is to stand for them."""
MUCH_MORE = 3.0
"""Times what a hidden input gains that effects explain which are named before it."""
IN_ONE = 3.0
"""Times what it needs to gain that an input must gain which acts in one recording alone."""
ROUNDS = 5
"""Rounds in which what was accepted is fitted without drifts."""


@dataclass(frozen=True)
class _Hidden:
    """An input that acts in windows at a place: a model in which it is free beside `effects`, and
    what it `gained` [nats] over these. `explained` is what they had gained before it was found.
    """

    locus: Locus
    model: Estimate
    effects: tuple[Tried, ...]
    gained: float
    evidence: Evidence
    explained: float = 0.0


def _counted(known: Evidence) -> float:
    """Return what an input gains [nats] as it counts: it may act in one recording alone."""
    return counted(known, alone=IN_ONE)


def with_hidden(
    bench: Bench,
    selection: Selection,
    loci: Sequence[Locus],
    needed: float,
    tell: Tell = lambda text: None,
) -> tuple[Selection, tuple[Locus, ...]]:
    """Return a selection with a hidden input, and the places with what it does over time.

    It stands for effects that explain less than it, and behind those that explain more. Gains are
    those over a model without drifts, of which the one as it is may have taken its part. `needed`
    are the nats that it must gain at least.
    """
    found = _found(bench, selection, loci, needed)
    if found is None or _counted(found.evidence) < needed:
        return selection, tuple(loci)
    layer, quiet = _inputs(bench)[found.locus.path], freed(bench, selection.base)
    gained = f"accepted {layer.id}: {_counted(found.evidence):.0f} nats"
    beside = f", beside effects that explain {found.explained:.0f}" if found.effects else ""
    tell(f"{gained}, silent most of the time{beside}")
    place = _from_silence(bench, found.locus, found.model)
    assert place.free is not None
    model = with_normal(place.free, bench.series)
    others = (one for one in loci if one.path != place.path)
    hidden = Tried(layer, found.gained, model, found.evidence)
    known = selection.first_round
    is_less = _is_less(bench, found)
    selection = dataclasses.replace(
        selection,
        base=quiet,
        model=model,
        accepted=(*found.effects, hidden) if is_less else (hidden, *found.effects),
        first_round=known if is_less else (hidden, *known),
        rivals=(),
    )
    return selection, (place, *others)


def _is_less(bench: Bench, found: _Hidden) -> bool:
    """Tell whether effects are named before a hidden input: they gain more beside the drifts of
    the base, explain much more than it where nothing drifts, or one acts at its place. What it
    explains there is then what the form of that one does not.
    """
    gained = sum(one.evidence.train for one in found.effects if one.evidence)
    if gained > _counted(found.evidence) or found.explained > MUCH_MORE * found.gained:
        return True
    places = (place_path(one.layer).partition(".") for one in found.effects)
    return any(acting(bench, section, place) == found.locus.path for section, _, place in places)


def _found(
    bench: Bench, selection: Selection, loci: Sequence[Locus], needed: float
) -> _Hidden | None:
    """Return what acts in windows at one of the places that gain much.

    Alone it has to gain nearly as much as any other place does, such as the inside of a shaft.
    One that is silent most of the time is the simpler of two that gain nearly the same. Where none
    is, effects may be what is heard there all the time: then beside these, unless they are
    something else themselves.
    """
    may_join = not remembers(bench, selection)
    shrink = 1.0 / inflation(selection.base, bench.series)
    known = _inputs(bench)
    loud = [one for one in loci if one.path in known and shrink * one.gain > needed]
    near = [one for one in loud if one.gain > NEAR * loud[0].gain]
    most = max((one.gain for one in loci), default=0.0)
    for locus in near:
        found = over_time(bench, locus)
        if not _is_hidden(bench, found):
            continue
        alone = _alone(bench, selection, found)
        if alone is None:
            return _beside(bench, selection, found) if may_join else None
        if locus.gain > NEAR * most:
            return _joined(bench, selection, alone)
    for locus in near if selection.accepted and may_join else ():
        if _is_heard(bench, selection.model, locus.drift, needed):
            beside = _beside(bench, selection, locus)
            if _is_hidden(bench, beside.locus):
                return beside
    return None


def _is_hidden(bench: Bench, locus: Locus) -> bool:
    """Tell whether what is unknown at a place acts in windows, along with nothing known."""
    values = [one.values for one in locus.unknown]
    follows = any(abs(r) > KNOWN for _, r in locus.along)
    if follows or not acts_in_windows(values):
        return False
    return stirring(bench.series, values) < STIRRED and resting(bench.series, values) < RESTING


def _is_heard(bench: Bench, model: Estimate, name: str, needed: float) -> bool:
    """Tell whether a drift may gain enough beside a model, whose parameters stay where they are."""
    units = units_of(model.candidate, bench.series, model.values(0))
    small = with_levels(model.noises, units, dict.fromkeys(units, SMALL_LEVEL))
    without = looked_at(model.candidate, bench.series, small, model.point)
    free = scanned(without, bench.series, units, name, ALL_LEVELS)
    return (without.cost - free.cost) / inflation(model, bench.series) > needed


def _alone(bench: Bench, selection: Selection, locus: Locus) -> _Hidden | None:
    """Return a hidden input that explains much more than what was accepted."""
    assert locus.free is not None, "a locus with a gain was let free"
    quiet, model = freed(bench, selection.base), with_normal(locus.free, bench.series)
    gained = quiet.cost - model.cost
    if selection.accepted:
        without = _quieted(bench, selection.model)
        if quiet.cost - without.cost > LITTLE * gained:
            return None
    return _Hidden(locus, model, (), gained, evidence(model, quiet, bench.series))


def _joined(bench: Bench, selection: Selection, alone: _Hidden) -> _Hidden:
    """Return a hidden input with the effects that are asked for beside it, of those that gained
    most without it; with none where none was accepted then.
    """
    if not selection.accepted:
        return alone
    model = alone.model
    units = units_of(model.candidate, bench.series, model.values(0))
    others = {name: unit for name, unit in units.items() if name != alone.locus.drift}
    needed = Thresholds(usual=max(USUAL, PART * _counted(alone.evidence)))
    found = selected(bench, model, others, needed, known=selection.first_round)
    return dataclasses.replace(alone, model=found.model, effects=found.accepted)


def _beside(bench: Bench, selection: Selection, locus: Locus) -> _Hidden:
    """Return a hidden input beside what was accepted, but for what it makes needless."""
    drift = next(one for one in bench.drifts if one.place == locus.place)
    without = _quieted(bench, selection.model)
    model = with_normal(freed(bench, selection.model, drift), bench.series)
    gained = evidence(model, without, bench.series)
    effects = selection.accepted
    for tried in selection.accepted:
        rest = tuple(one for one in effects if one is not tried)
        candidate = bench.possible([one.layer for one in rest])
        if candidate is None:
            continue
        start = extended(candidate, model.candidate, model.point, {})
        fewer = freed(bench, looked_at(candidate, bench.series, without.noises, start), drift)
        fewer = with_normal(fewer, bench.series)
        if evidence(model, fewer, bench.series).least <= USUAL:
            effects, model = rest, fewer
    if not locus.unknown or not _is_hidden(bench, locus):
        locus = over_time(bench, dataclasses.replace(locus, free=model, unknown=()))
    explained = freed(bench, selection.base).cost - without.cost
    return _Hidden(locus, model, effects, without.cost - model.cost, gained, explained)


def _quieted(bench: Bench, model: Estimate) -> Estimate:
    """Return a model fitted with next to no drift: what it explains without."""
    units = units_of(model.candidate, bench.series, model.values(0))
    noises = with_levels(model.noises, units, dict.fromkeys(units, SMALL_LEVEL))
    return followed(model.candidate, bench.series, noises, model.point, ROUNDS)


def _from_silence(bench: Bench, locus: Locus, free: Estimate) -> Locus:
    """Return a place with a model in which it is `free`, its parameters from where it is silent.

    First from where it is not among what is loudest, then from where it is nothing for sure, if
    all is foreseen better so. What it shows in silence is its error, and no standard deviation is
    less than that.
    """
    least = _loudest([one.values for one in locus.unknown])
    silent = [np.abs(one.values) < least for one in locus.unknown]
    free = from_silence(free, bench.series, [~one for one in silent], locus.drift)
    locus = over_time(bench, dataclasses.replace(locus, free=free, unknown=()))
    again = from_silence(free, bench.series, [one.sure for one in locus.unknown], locus.drift)
    if again.cost < free.cost:
        locus = over_time(bench, dataclasses.replace(locus, free=again, unknown=()))
    pairs = zip(locus.unknown, silent, strict=True)
    ratios = np.concatenate([np.abs(one.values / one.stds)[rows] for one, rows in pairs])
    scale = max(1.0, MAD * float(np.median(ratios)))
    wider = (Unknown(one.values, scale * one.stds) for one in locus.unknown)
    return told(bench, locus, tuple(wider))


def acts_in_windows(drifts: Sequence[Reals]) -> bool:
    """Tell whether a drift is silent most of the time."""
    whole = np.abs(np.concatenate(drifts))
    return bool(np.mean(whole >= _loudest(drifts)) < SHORT)


def _loudest(drifts: Sequence[Reals]) -> float:
    """Return the amount from which on the samples of a drift have most of its squares."""
    falling = np.sort(np.abs(np.concatenate(drifts)))[::-1]
    whole = np.cumsum(falling**2)
    return float(falling[np.searchsorted(whole, MOST * whole[-1])])


def _inputs(bench: Bench) -> dict[str, Layer]:
    """Return, by path, the inputs without parameters that the library knows for balances."""
    balances = {drift.place for drift in bench.drifts}
    return {
        f"flow.{layer.place}": layer
        for effect in bench.effects
        if effect.body.get("parameters") is None
        for layer in fitting(bench.document, effect)
        if layer.place in balances
    }
