"""Swap: an effect that was accepted first stands aside for one that goes better with the others.

While something else is missing too, the effect with the most freedom explains some of that as
well: friction with a rise at rest takes up part of an offset that dry friction alone cannot.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from diagnosis.bench import Bench
from diagnosis.candidate import Candidate
from diagnosis.estimate import Estimate, looked_like
from diagnosis.evidence import Evidence, evidence, more
from diagnosis.layers import Layer
from diagnosis.level import fitted
from diagnosis.plainer import may_be_plainer
from diagnosis.point import Point, extended
from diagnosis.rival import NEARLY
from diagnosis.screening import starts_of
from diagnosis.search import Tell, Tried
from diagnosis.strain import is_at_limit

CLEARLY = 3.0
"""Nats by which the model must be better with the other effect."""
RIVAL_PART, CONFUSED_PART = 0.5, 0.25
"""Part of what an accepted effect gained that another one gained alone, if it may stand for it; and
one that it is known to be confused with."""


def swapped(
    bench: Bench,
    model: Estimate,
    accepted: Sequence[Tried],
    rivals: Sequence[Tried],
    units: Mapping[str, float],
    tell: Tell,
) -> tuple[list[Tried], Estimate]:
    """Return the accepted effects and their model, each but the last swapped where that is better.

    What it is swapped with are `rivals` at the same place; what is known to be confused with it is
    tried though it did not promise enough alone to be fitted: it then gains more than the old one.
    """
    kept = list(accepted)
    for k, old in enumerate(accepted[:-1]):
        for rival in rivals:
            ids = {tried.layer.id for tried in kept}
            if rival.layer.id in ids or not _may_stand_for(rival, old):
                continue
            layers = [rival.layer if tried is kept[k] else tried.layer for tried in kept]
            candidate = bench.possible(layers)
            if candidate is None:
                continue
            start = _start(bench, candidate, rival, model)
            tried = fitted(candidate, bench.series, model.noises, start, units, like=model)
            if may_be_plainer(tried, rival.layer, bench.series):
                continue
            gained = evidence(tried, model, bench.series)  # prices counted
            if gained.train > _needed(kept[k], tried, rival.layer):
                tell(f"{rival.layer.id} goes better with the others than {kept[k].layer.id}")
                kept[k], model = _credited(rival, kept[k], tried, gained), tried
    return kept, model


def _needed(old: Tried, model: Estimate, layer: Layer) -> float:
    """Return what a model with a rival in the place of an accepted effect has to gain [nats]: where
    the rival is at a limit, more than what keeps nearly as good ones apart.
    """
    gained = old.evidence.train if old.evidence else 0.0
    return max(CLEARLY, (1.0 - NEARLY) * gained) if is_at_limit(model, layer) else CLEARLY


def _may_stand_for(rival: Tried, old: Tried) -> bool:
    """Tell whether a rival is at the place of an accepted effect, and gained not much less or is
    one that this is confused with.
    """
    if rival.layer.place != old.layer.place or old.evidence is None:
        return False
    is_confused = rival.layer.effect.name in old.layer.effect.confused_with
    if rival.evidence is None:
        return is_confused
    part = CONFUSED_PART if is_confused else RIVAL_PART
    return rival.evidence.train > part * old.evidence.train


def _credited(rival: Tried, old: Tried, model: Estimate, gained: Evidence) -> Tried:
    """Return a rival with what it gains alone, or what it gains in the place of the old one."""
    if rival.evidence is not None or old.evidence is None:
        return rival
    return Tried(rival.layer, rival.promised, model, more(old.evidence, gained))


def _start(bench: Bench, candidate: Candidate, rival: Tried, model: Estimate) -> Point:
    """Return where a fit with a rival begins: where it was alone, or the best of its starts."""
    given = candidate, model.candidate, model.point
    if rival.estimate is not None:
        alone = rival.estimate
        return extended(*given, extended(candidate, alone.candidate, alone.point, {}))
    starts = [extended(*given, start) for start in starts_of(candidate, model.values(0))]
    return min(
        starts, key=lambda p: looked_like(candidate, bench.series, model.noises, p, model).cost
    )
