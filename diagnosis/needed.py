"""Needed: which of the accepted effects are, beside those that were found after them.

The first one was accepted while all others were missing: it may have stood in for one of them, or
be less of it than the other. What needless ones seemed to gain goes to those at their place.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from diagnosis.bench import Bench
from diagnosis.estimate import Estimate
from diagnosis.evidence import Evidence, evidence, less
from diagnosis.level import settled
from diagnosis.naming import place_path
from diagnosis.point import extended
from diagnosis.search import Tell, Tried
from diagnosis.share import counted
from diagnosis.threshold import Thresholds

STAND_IN = 0.25
"""Part of what another one at its place gains that an effect found before it must add to that: it
may have stood in for it."""


@dataclass(frozen=True)
class Needed:
    """Effects over a `base` that a `model` holds, the order in which they are named."""

    base: Estimate
    model: Estimate
    kept: tuple[Tried, ...]


def still_needed(
    bench: Bench, found: Needed, units: Mapping[str, float], thresholds: Thresholds, tell: Tell
) -> Needed:
    """Take out what the effects found after it have made needless; put first at a place what is
    worth most there.
    """
    for tried in found.kept[:-1]:
        without = _without(bench, found, tried, units)
        if without is None:
            continue
        worth = evidence(found.model, without, bench.series)
        beside = [t for t in found.kept if t is not tried and _place(t) == _place(tried)]
        most = max((t.evidence.train for t in beside if t.evidence), default=0.0)
        gained = sum(t.evidence.train for t in beside if t.evidence)
        if counted(worth) <= max(thresholds.of(tried.layer), STAND_IN * gained):
            tell(f"{tried.layer.id} is needless beside the others")
            rest = tuple(t for t in found.kept if t is not tried)
            found = Needed(found.base, without, _credited(bench, rest, tried, found.base, without))
        elif worth.train < most:
            tell(f"{tried.layer.id} adds less than what was found after it at its place")
            rest = tuple(t for t in found.kept if t is not tried)
            first = _credited(bench, rest, tried, found.base, without)
            last = dataclasses.replace(tried, evidence=worth)
            found = Needed(found.base, found.model, (*first, last))
        else:
            new = dataclasses.replace(tried, beside=worth.train)
            kept = tuple(new if t is tried else t for t in found.kept)
            found = Needed(found.base, found.model, kept)
    return found


def _without(
    bench: Bench, found: Needed, tried: Tried, units: Mapping[str, float]
) -> Estimate | None:
    """Return the model without one of its effects, fitted from where it is."""
    candidate = bench.possible([other.layer for other in found.kept if other is not tried])
    if candidate is None:
        return None
    start = extended(candidate, found.model.candidate, found.model.point, {})
    given = (found.base.noises, start, units)
    make = partial(settled, candidate, bench.series, *given, like=found.model)
    return bench.kept("settled", candidate, (*given, found.model.gains), make)


def _credited(
    bench: Bench, rest: tuple[Tried, ...], gone: Tried, base: Estimate, model: Estimate
) -> tuple[Tried, ...]:
    """Return the rest with what it gains without the one that is gone: the first one at its place,
    or the first of all, has what the others have not.
    """
    heir = next((t for t in rest if _place(t) == _place(gone)), rest[0])
    others = [t.evidence for t in rest if t is not heir and t.evidence]
    own: Evidence = less(evidence(model, base, bench.series), others)
    estimate = model if len(rest) == 1 else heir.estimate
    new = dataclasses.replace(heir, evidence=own, estimate=estimate)
    return tuple(new if t is heir else t for t in rest)


def renewed(first: Sequence[Tried], before: Sequence[Tried], kept: Sequence[Tried]) -> list[Tried]:
    """Return the candidates of the first round: those that stood aside for another are none, the
    first one that is kept gains what it does now.
    """
    out = {t.layer.id for t in before} - {t.layer.id for t in kept}
    left = [Tried(t.layer, t.promised) if t.layer.id in out else t for t in first]
    leading = {t.layer.id: t for t in kept[:1]}
    return [leading.get(t.layer.id, t) for t in left]


def _place(tried: Tried) -> str:
    return place_path(tried.layer)
