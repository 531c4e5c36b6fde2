"""Swap: an effect that was accepted first stands aside for one that goes better with the others.

While something else is missing too, the effect with the most freedom explains some of that as
well: friction with a rise at rest takes up part of an offset that dry friction alone cannot.
"""

from __future__ import annotations

from collections.abc import Mapping

from diagnosis.bench import Bench
from diagnosis.estimate import Estimate
from diagnosis.evidence import evidence
from diagnosis.level import fitted
from diagnosis.plainer import may_be_plainer
from diagnosis.point import extended
from diagnosis.search import Tell, Tried

CLEARLY = 3.0
"""Nats by which the model must be better with the other effect."""
NEARLY = 0.5
"""Part of what an accepted effect gains that another one gained alone, if it may stand for it."""


def swapped(
    bench: Bench,
    model: Estimate,
    accepted: list[Tried],
    rivals: list[Tried],
    units: Mapping[str, float],
    tell: Tell,
) -> tuple[list[Tried], Estimate]:
    """Return the accepted effects and their model, each but the last swapped where that is better.

    What it is swapped with are `rivals` at the same place.
    """
    kept = list(accepted)
    for k, old in enumerate(accepted[:-1]):
        for rival in rivals:
            ids = {tried.layer.id for tried in kept}
            if rival.layer.id in ids or not _may_stand_for(rival, old):
                continue
            layers = [rival.layer if tried is kept[k] else tried.layer for tried in kept]
            candidate = bench.possible(layers)
            if candidate is None or rival.estimate is None:
                continue
            start = extended(candidate, rival.estimate.candidate, rival.estimate.point, {})
            start = extended(candidate, model.candidate, model.point, start)
            tried = fitted(candidate, bench.series, model.noises, start, units, like=model)
            if may_be_plainer(tried, rival.layer, bench.series):
                continue
            if _gain(tried, model, bench) > CLEARLY:
                tell(f"{rival.layer.id} goes better with the others than {kept[k].layer.id}")
                kept[k], model = rival, tried
    return kept, model


def _may_stand_for(rival: Tried, old: Tried) -> bool:
    """Tell whether a rival is at the place of an accepted effect, and gained not much less."""
    if rival.evidence is None or old.evidence is None or rival.layer.place != old.layer.place:
        return False
    return rival.evidence.train > NEARLY * old.evidence.train


def _gain(new: Estimate, old: Estimate, bench: Bench) -> float:
    """Return what one model gains over another that it does not extend [nats], prices counted."""
    return evidence(new, old, bench.series).train
