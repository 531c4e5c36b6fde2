"""Form: which of two is shown, an effect or the plainer one that it is without some of its numbers.

Prices of numbers do not tell: those that the recordings hardly determine cost as much as others.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from functools import partial

from diagnosis.bench import Bench
from diagnosis.candidate import Candidate
from diagnosis.estimate import Estimate
from diagnosis.evidence import evidence, inflation
from diagnosis.layers import Layer
from diagnosis.level import settled
from diagnosis.naming import brought_by, place_path
from diagnosis.plainer import PLAINER_PART, has_plain
from diagnosis.point import Point, extended
from diagnosis.screening import starts_of
from diagnosis.search import Tried

SHOWN = 4.0
"""Nats by which the fuller form must fit better, no price counted: where the plainer one is right
it does by 2.6 at most, where it is not by 5.2 at least (63 dry frictions of two studies)."""


def shown_form(
    bench: Bench, base: Estimate, units: Mapping[str, float], best: Tried, tried: Sequence[Tried]
) -> Tried:
    """Return the best candidate, or its plainer or fuller form where the recordings show that one.

    Each is fitted from where the other is as well: which one fits better is not to be an accident.
    """
    for other in tried:
        if best.estimate is None or not _is_form_of(other, best):
            continue
        new = _from(bench, base, units, other, best.estimate)
        if new is not None and new.estimate is not None:
            old = _from(bench, base, units, best, new.estimate) or best
            plain, full = sorted((old, new), key=_numbers)
            return full if _is_shown(bench, plain, full) else plain
    return best


def _is_form_of(other: Tried, best: Tried) -> bool:
    """Tell whether a candidate may be another form of the best one: at its place, with more or
    fewer numbers, some of them the same; one that was fitted gained nearly as much.
    """
    plain, full = sorted((other, best), key=_numbers)
    is_beside = place_path(other.layer) == place_path(best.layer)
    if not is_beside or _numbers(plain) == _numbers(full) or not has_plain(full.layer):
        return False
    if not brought_by(plain.layer).keys() & brought_by(full.layer).keys():
        return False
    if other.evidence is None or best.evidence is None:
        return True
    return other.evidence.train > PLAINER_PART * best.evidence.train


def _from(
    bench: Bench, base: Estimate, units: Mapping[str, float], tried: Tried, other: Estimate
) -> Tried | None:
    """Return a candidate fitted from where another one is as well, what that does not have from
    where it was and from each of its starts; None where it cannot be laid on the base.
    """
    candidate = _candidate(bench, base, tried.layer, tried.estimate)
    if candidate is None:
        return None
    own: list[Mapping[str, float] | Point] = [*starts_of(candidate, other.values(0))]
    own += [tried.estimate.point] if tried.estimate else []
    found = [tried.estimate] if tried.estimate else []
    for start in (extended(candidate, other.candidate, other.point, one) for one in own):
        given = (other.noises, start, units)
        make = partial(settled, candidate, bench.series, *given, like=other)
        found.append(bench.kept("settled", candidate, (*given, other.gains), make))
    model = min(found, key=lambda one: one.cost)
    if model is tried.estimate:
        return tried
    return dataclasses.replace(tried, estimate=model, evidence=evidence(model, base, bench.series))


def _candidate(
    bench: Bench, base: Estimate, layer: Layer, fitted: Estimate | None
) -> Candidate | None:
    return fitted.candidate if fitted else bench.possible([*base.candidate.layers, layer])


def _is_shown(bench: Bench, plain: Tried, full: Tried) -> bool:
    """Tell whether recordings show the fuller form of an effect."""
    assert plain.estimate is not None
    assert full.estimate is not None
    apart = plain.estimate.cost - full.estimate.cost
    return apart / inflation(full.estimate, bench.series) > SHOWN


def _numbers(tried: Tried) -> int:
    return len(brought_by(tried.layer))
