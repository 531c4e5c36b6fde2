"""Search: which effects at which places foresee the training recordings better than the base."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from diagnosis.adaptation import turned
from diagnosis.bench import Bench
from diagnosis.candidate import Candidate
from diagnosis.estimation import Estimate, looked_at, reached, seen_at
from diagnosis.evidence import Evidence, evidence, inflation
from diagnosis.layers import Layer
from diagnosis.level import fitted
from diagnosis.point import Point, extended, point_of
from language.effect import own_names

FULL_FITS = 7
"""Candidates that are fitted to the end, best foreseen first."""
POOR = 2.0
"""Innovations that count as one, from which on a fit is no good."""
MOST_SCREENED = 5
"""Recordings that candidates are screened on first, spread over all."""
HINT = 2.0
"""Nats that a candidate gains there at least, if it is to be screened on all."""
HINT_PART = 0.1
"""Part of what it has to promise that it gains there."""
STARTS = 2
"""Starts of a candidate from which steps are made, the best ones."""
HOPELESS = 0.05
"""A candidate that promises less than this part of what another has gained is not fitted."""
PLAIN = 2.5
"""Nats that each number of an effect has to gain beyond its price."""
WORTH = 10.0
"""A candidate that promises less [nats] is not fitted."""
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Tried:
    """A candidate with what it promised; `estimate` and `evidence` where it was fitted."""

    layer: Layer
    promised: float
    estimate: Estimate | None = field(default=None, repr=False)
    evidence: Evidence | None = None

    @property
    def score(self) -> float:
        """What candidates are ranked by: what they gain, less for each number that they bring.

        One that brings more also takes up what the form of a plainer one gets wrong. What is left
        out counts as much as what was fitted at most: more is an accident.
        """
        if self.evidence is None or self.estimate is None:
            return self.promised - 1e6
        names = [self.layer.named(name) for name in own_names(self.layer.effect.body)]
        brought = set(names) & set(self.estimate.candidate.names)
        return self.evidence.train + self.evidence.least - PLAIN * len(brought)


def searched(
    bench: Bench,
    base: Estimate,
    units: Mapping[str, float],
    layers: Iterable[Layer],
    tell: Tell = lambda text: None,
    worth: float = WORTH,
) -> list[Tried]:
    """Return the candidates that could be laid on the base's layers, best first."""
    promised: list[tuple[float, Layer, Estimate]] = []
    for layer in layers:
        candidate = _possible(bench, base, layer)
        if candidate is not None:
            hint = max(HINT, HINT_PART * worth)
            make = partial(screened, bench, candidate, base, hint)
            known = [base.candidate, base.point, base.noises, base.columns, hint]
            start = bench.kept("screened", candidate, known, make)
            promised.append((base.cost - start.cost, layer, start))
    promised.sort(key=lambda one: -one[0])
    found: list[Tried] = []
    for place, (gain, layer, start) in enumerate(promised):
        best = max((one.evidence.train for one in found if one.evidence), default=0.0)
        if place >= FULL_FITS or gain < max(worth, HOPELESS * best):
            found.append(Tried(layer, gain))
            continue
        given = (base.noises, start.point, units, start.cost - WORTH)
        make = partial(_fitted, bench, base, start, units)
        estimate = bench.kept("fitted", start.candidate, given, make)
        if not np.isfinite(estimate.cost):
            found.append(Tried(layer, gain))
            continue
        gains = evidence(estimate, base, bench.series)
        tell(f"{layer.id}: train {gains.train:.0f}, left out {gains.left_out:.0f} nats")
        found.append(Tried(layer, gain, estimate, gains))
    return sorted(found, key=lambda one: -one.score)


def _fitted(bench: Bench, base: Estimate, start: Estimate, units: Mapping[str, float]) -> Estimate:
    """Return a candidate fitted from where screening left it.

    Where that is no good it is fitted from where the base is declared as well: what lacks something
    may have led the base far astray.
    """
    candidate, known = start.candidate, start.cost - WORTH
    first = fitted(candidate, bench.series, base.noises, start.point, units, known)
    if not np.isfinite(first.cost) or inflation(first, bench.series) < POOR:
        return first
    point = point_of(candidate, len(bench.series), {})
    own = [k for k, name in enumerate(candidate.names) if name not in base.candidate.names]
    point.shared[own], point.own[:, own] = start.point.shared[own], start.point.own[:, own]
    again = fitted(candidate, bench.series, base.noises, point, units, first.cost)
    return min(first, again, key=lambda one: one.cost)


def screened(bench: Bench, candidate: Candidate, base: Estimate, hint: float = HINT) -> Estimate:
    """Return a candidate some steps from the best of its starts, seen from there.

    Where there are many recordings, first on some: one that gains less than a `hint` [nats] there,
    and as it starts on all, is not looked at further.
    """
    rows = _screened_on(candidate, len(bench.series))
    every = list(range(len(bench.series)))
    found = _reached(bench, candidate, base, rows)
    if rows == every:
        return found
    whole = extended(candidate, base.candidate, base.point, {})
    whole.own[rows] = found.point.own
    series = [bench.series[row] for row in rows]
    part = seen_at(base, series, Point(base.point.shared, base.point.own[rows]))
    if part.cost - found.cost < hint:
        point = Point(found.point.shared, whole.own)
        known = [seen_at(found, bench.series, point), _started(bench, candidate, base)]
        best = min(known, key=lambda one: one.cost)
        if base.cost - best.cost < hint:
            return best
    return _reached(bench, candidate, base, every)


def _started(bench: Bench, candidate: Candidate, base: Estimate) -> Estimate:
    """Return a candidate at its first start: some show themselves in few recordings alone."""
    start = starts_of(candidate, base.values(0))[0]
    point = extended(candidate, base.candidate, base.point, start)
    return looked_at(candidate, bench.series, base.noises, point)


def _reached(bench: Bench, candidate: Candidate, base: Estimate, rows: list[int]) -> Estimate:
    """Return a candidate some steps from the best of its starts, on some recordings.

    How the base's parameters act is taken from the base.
    """
    series = [bench.series[row] for row in rows]
    parts = [base.outcome.parts[row] for row in rows]
    columns = {name: np.concatenate([c[p] for p in parts]) for name, c in base.columns.items()}
    found = []
    for start in starts_of(candidate, base.values(0)):
        whole = extended(candidate, base.candidate, base.point, start)
        point = Point(whole.shared, whole.own[rows])
        here = looked_at(candidate, series, base.noises, point)
        found.append(turned(here, series))
    found.sort(key=lambda one: one.cost)
    reach = [reached(here, series, columns) for here in found[:STARTS]]
    best = min(reach, key=lambda one: one.cost)
    again = turned(best, series)
    return reached(again, series, columns) if again.cost < best.cost - HINT else best


def _screened_on(candidate: Candidate, count: int) -> list[int]:
    """Return the recordings to begin with: all where each has numbers of its own."""
    if count <= MOST_SCREENED or any(one.per_recording for one in candidate.uncertain):
        return list(range(count))
    return [round(k * (count - 1) / (MOST_SCREENED - 1)) for k in range(MOST_SCREENED)]


def starts_of(candidate: Candidate, base: Mapping[str, float]) -> list[dict[str, float]]:
    """Return where a fit may start: each start of the parameters that the base does not have."""
    own = [one for one in candidate.uncertain if one.name not in base]
    most = max((len(one.starts) for one in own if not one.per_recording), default=1)
    return [{one.name: one.starts[min(k, len(one.starts) - 1)] for one in own} for k in range(most)]


def _possible(bench: Bench, base: Estimate, layer: Layer) -> Candidate | None:
    layers: Sequence[Layer] = base.candidate.layers
    if any(layer.id == known.id for known in layers):
        return None
    return bench.possible([*layers, layer])
