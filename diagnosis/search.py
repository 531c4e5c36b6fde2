"""Search: which effects at which places foresee the training recordings better than the base."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from diagnosis.bench import Bench
from diagnosis.estimate import Estimate, looked_like
from diagnosis.evidence import Evidence, evidence, inflation
from diagnosis.layers import Layer, has_parameters
from diagnosis.level import fitted
from diagnosis.naming import brought_by
from diagnosis.point import extended, point_of
from diagnosis.pressed import eased, pressed_places
from diagnosis.screening import HINT, Promise, promises, starts_of
from diagnosis.share import ALONE, ranked

FULL_FITS, FITS_BESIDE = 7, 4
"""Candidates that are fitted to the end, best foreseen first: alone, and beside what was accepted,
where most of what the others promise is explained."""
FITS_EASED = 3
"""Candidates that are fitted beside accepted effects where these press a parameter of the base to
the end of its range: a friction that promised 25 nats gained 166 once the base was eased."""
POOR = 2.0
"""Innovations that count as one, from which on a fit is no good."""
HINT_PART = 0.1
"""Part of what a candidate has to promise that it gains on some recordings, to be seen on all."""
HOPELESS = 0.25
"""A candidate that promises less than this part of what another has gained is not fitted."""
PLAIN = 2.5
"""Nats that each number of an effect has to gain beyond its price."""
WORTH = 10.0
"""A candidate that promises less [nats] is not fitted."""
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Tried:
    """A candidate with what it promised; `estimate` and `evidence` where it was fitted.

    `lead` [nats] is what puts it before one that gave way to it, `beside` what it gains beside all
    that were accepted, where that was looked for.
    """

    layer: Layer
    promised: float
    estimate: Estimate | None = field(default=None, repr=False)
    evidence: Evidence | None = None
    lead: float = 0.0
    beside: float = 0.0

    @property
    def own(self) -> dict[str, float]:
        """What the effect's own parameters are that all recordings share; none if not fitted."""
        if self.estimate is None:
            return {}
        values, brought = self.estimate.values(0), brought_by(self.layer)
        uncertain = self.estimate.candidate.uncertain
        return {
            one.name: values[one.name]
            for one in uncertain
            if one.name in brought and not one.per_recording
        }

    @property
    def gained(self) -> float:
        """What it gained [nats] when it was accepted, or gains beside the others where that is
        more: while something else is missing, the right one may gain little.
        """
        return max(self.evidence.train if self.evidence else 0.0, self.beside)

    @property
    def score(self) -> float:
        """What candidates are ranked by: what they gain, less for each number that they bring.

        One that brings more also takes up what the form of a plainer one gets wrong. What is left
        out counts as much as what was fitted at most: more is an accident. So is what one recording
        gains alone, but for an input without parameters.
        """
        if self.evidence is None or self.estimate is None:
            return self.promised - 1e6
        brought = brought_by(self.layer).keys() & set(self.estimate.candidate.names)
        gained = ranked(self.evidence, ALONE if has_parameters(self.layer) else 1.0)
        return gained + self.lead - PLAIN * len(brought)


def searched(
    bench: Bench,
    base: Estimate,
    units: Mapping[str, float],
    layers: Iterable[Layer],
    tell: Tell = lambda text: None,
    worth: float = WORTH,
    alone: Iterable[Tried] = (),
) -> list[Tried]:
    """Return the candidates that could be laid on the base's layers, best first; they start where
    they were fitted `alone`, too.
    """
    least = max(HINT, HINT_PART * worth)
    there = {layer.id for layer in base.candidate.layers}
    new = [layer for layer in layers if layer.id not in there]
    made = bench.all_possible([[*base.candidate.layers, layer] for layer in new])
    known = [(layer, one) for layer, one in zip(new, made, strict=True) if one is not None]
    found: list[Tried] = []
    chances = _Chances(bench, base, worth)
    fits = {one.layer.id: one.own for one in alone if one.estimate}
    for promise in promises(bench, base, known, least, fits):
        gain, layer, start = promise.gain, promise.layer, chances.start(promise, found)
        if start is None:
            found.append(Tried(layer, gain))
            continue
        given = (base.noises, start.point, start.columns, start.gains, units, start.cost - WORTH)
        make = partial(_fitted, bench, base, start, units)
        estimate = bench.kept("fitted", start.candidate, given, make)
        if not np.isfinite(estimate.cost):
            found.append(Tried(layer, gain))
            continue
        gains = evidence(estimate, base, bench.series)
        tell(f"{layer.id}: train {gains.train:.0f}, left out {gains.left_out:.0f} nats")
        found.append(Tried(layer, gain, estimate, gains))
    return sorted(found, key=lambda one: -one.score)


class _Chances:
    """Which candidates beside a base are fitted to the end: a few of those that promise what is
    worth it; beside accepted effects a few where the base is pressed, whatever they promise.
    """

    def __init__(self, bench: Bench, base: Estimate, worth: float) -> None:
        """None of them is used yet."""
        is_beside = bool(base.candidate.layers)
        self._bench, self._base, self._worth = bench, base, worth
        self._left = FITS_BESIDE if is_beside else FULL_FITS
        self._eased = FITS_EASED if is_beside else 0
        self._pressed = pressed_places(base, bench.automaton)

    def start(self, promise: Promise, found: Sequence[Tried]) -> Estimate | None:
        """Return where a fit of a candidate starts; None where it is not fitted."""
        best = max((one.evidence.train for one in found if one.evidence), default=0.0)
        is_worth = promise.gain >= max(self._worth, HOPELESS * best)
        if promise.start is not None and is_worth and self._left > 0:
            self._left -= 1
            return promise.start
        if promise.layer.place in self._pressed and promise.gain > 0.0 and self._eased > 0:
            self._eased -= 1
            return _eased(self._bench, self._base, promise.layer)
        return None


def _eased(bench: Bench, base: Estimate, layer: Layer) -> Estimate | None:
    """Return a candidate where it starts, beside a base whose pressed parameters are declared."""
    candidate = bench.possible([*base.candidate.layers, layer])
    if candidate is None:
        return None
    start = starts_of(candidate, base.values(0))[0]
    point = extended(candidate, base.candidate, eased(base, bench.automaton), start)
    return looked_like(candidate, bench.series, base.noises, point, base)


def _fitted(bench: Bench, base: Estimate, start: Estimate, units: Mapping[str, float]) -> Estimate:
    """Return a candidate fitted from where screening left it.

    Where that is no good it is fitted from where the base is declared as well: what lacks something
    may have led the base far astray.
    """
    candidate, known = start.candidate, start.cost - WORTH
    given = bench.series, base.noises
    first = fitted(candidate, *given, start.point, units, known, start.columns, start)
    if not np.isfinite(first.cost) or inflation(first, bench.series) < POOR:
        return first
    point = point_of(candidate, len(bench.series), {})
    own = [k for k, name in enumerate(candidate.names) if name not in base.candidate.names]
    point.shared[own], point.own[:, own] = start.point.shared[own], start.point.own[:, own]
    again = fitted(candidate, *given, point, units, first.cost)
    return min(first, again, key=lambda one: one.cost)
