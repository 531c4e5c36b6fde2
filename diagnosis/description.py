"""Description: what an unknown is, as a formula - found by regression, fitted as an effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from diagnosis.bench import Bench
from diagnosis.estimate import Estimate, looked_at
from diagnosis.evidence import Evidence, evidence
from diagnosis.excess import Excess, excess_at
from diagnosis.formula import Formula, formula_of
from diagnosis.level import settled
from diagnosis.locus import Locus
from diagnosis.naming import quantities_of
from diagnosis.point import Point, point_of
from diagnosis.regression import Columns, forward, ranking, weights
from diagnosis.search import Tell
from language.problem import SpecError

PLACES = 2
"""Places that are looked at, those whose freedom explains most."""
FITTED = 3
"""Formulas that are fitted, the best of the regressions."""
MOST_TERMS = 2
LEADING_PART = 0.85
"""A formula at a place that asked for more of a freedom has to gain only this part."""
FURTHER = 45.0
"""Nats that a second term has to gain."""


@dataclass(frozen=True)
class Description:
    """A formula at a place with its fit; `text` tells it with its values."""

    locus: Locus
    formula: Formula
    estimate: Estimate = field(repr=False)
    evidence: Evidence
    text: str


def described(
    bench: Bench,
    base: Estimate,
    loci: Sequence[Locus],
    units: Mapping[str, float],
    threshold: float,
    tell: Tell = lambda text: None,
) -> Description | None:
    """Return the formula that explains most of what the base lacks; None where none gains."""
    found: list[Description] = []
    for formula, locus in _formulas(bench, base, loci):
        starts = [base.values(0), _beside(base, locus)]
        one = _described(bench, base, formula, locus, starts, units)
        if one is not None:
            tell(_line(one))
            found.append(one)
    best = max(found, key=_total, default=None)
    if best is None or best.evidence.least <= threshold:
        return None
    ranks = [locus.path for locus in loci]
    for one in found:
        is_before = ranks.index(one.locus.path) < ranks.index(best.locus.path)
        if is_before:
            starts = [best.estimate.values(0)]
            again = _described(bench, base, one.formula, one.locus, starts, units)
            if again is not None and _total(again) > LEADING_PART * _total(best):
                tell(_line(again))
                best = again
    return best


def _total(one: Description) -> float:
    total = one.evidence.total
    return total if np.isfinite(total) else -np.inf


def _line(one: Description) -> str:
    known = one.evidence
    gains = f"train {known.train:.0f}, left out {known.left_out:.0f} nats"
    return f"{one.text} at {one.locus.path}: {gains}"


def _formulas(bench: Bench, base: Estimate, loci: Sequence[Locus]) -> list[tuple[Formula, Locus]]:
    """Return the formulas worth a fit: the best single terms, and the best one with a second."""
    options: list[tuple[float, Locus, Excess, tuple[Columns, ...]]] = []
    places = [one for one in loci if one.gain > 0.0 and not one.named][:PLACES]
    for locus in places:
        model = _model(bench, base, locus)
        excess = excess_at(bench, model, locus.section, locus.place)
        ranked = ranking(excess.problem, excess.columns)
        options += [(gain, locus, excess, (one,)) for gain, one in ranked[:FITTED]]
        chosen = forward(excess.problem, excess.columns, MOST_TERMS, FURTHER)
        if len(chosen) > 1:
            pair = tuple(one.columns for one in chosen)
            options.append((sum(one.gain for one in chosen), locus, excess, pair))
    options.sort(key=lambda option: -option[0])
    first = [max((o for o in options if o[1] is place), key=lambda o: o[0]) for place in places]
    worth = [*first, *(option for option in options if option not in first)][:FITTED]
    found = []
    for number, (gain, locus, excess, columns) in enumerate(worth, 1):
        if gain > 0.0:
            terms = [excess.terms[excess.columns.index(one)] for one in columns]
            values = weights(excess.problem, columns)
            with suppress(SpecError):
                formula = formula_of(bench, locus.section, locus.place, terms, values, number)
                found.append((formula, locus))
    return found


def _beside(base: Estimate, locus: Locus) -> dict[str, float]:
    """Return the parameters [SI] that were fitted beside the freedom of a place."""
    return (locus.free or base).values(0)


def _model(bench: Bench, base: Estimate, locus: Locus) -> Estimate:
    """Return the base, or what it is with the parameters fitted beside the freedom of a place."""
    point = point_of(base.candidate, len(bench.series), _beside(base, locus))
    other = looked_at(base.candidate, bench.series, base.noises, point)
    return other if other.cost < base.cost else base


def _described(
    bench: Bench,
    base: Estimate,
    formula: Formula,
    locus: Locus,
    starts: Sequence[Mapping[str, float]],
    units: Mapping[str, float],
) -> Description | None:
    """Return a formula fitted from the best of some values of the base's parameters."""
    try:
        candidate = bench.candidate((formula.layer,))
    except SpecError:
        return None
    looks = []
    for values in starts:
        point = point_of(candidate, len(bench.series), {**values, **formula.start})
        own = point.own.copy()
        for k, one in enumerate(candidate.uncertain):
            if one.name in formula.phases:
                own[:, k] = [one.coordinate(value) for value in formula.phases[one.name]]
        looks.append(looked_at(candidate, bench.series, base.noises, Point(point.shared, own)))
    start = min(looks, key=lambda one: one.cost).point
    found = settled(candidate, bench.series, base.noises, start, units)
    if not np.isfinite(found.cost) or found.normal is None:
        return None
    each = [found.values(k) for k in range(len(bench.series))]
    text = formula.told(quantities_of(found), each)
    return Description(locus, formula, found, evidence(found, base, bench.series), text)
