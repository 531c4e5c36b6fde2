"""Location: where something is missing - the place whose drift the recordings ask for most.

One drift at a time is let free beside the base; the one whose freedom explains most stands where
the model is deficient (Kristensen, Madsen, Jorgensen 2004). Where effects were accepted, their
places lead.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence

import numpy as np

from diagnosis.actor import acting, actors, rests
from diagnosis.bench import Bench
from diagnosis.estimate import Estimate
from diagnosis.evidence import inflation
from diagnosis.freedom import freed
from diagnosis.layers import Layer, drift
from diagnosis.locus import Locus, locus_of, over_time
from language.document import Table

DISTURBED = 0.3
"""Part that counts of what the small drifts of the base take up as well."""


def located(bench: Bench, base: Estimate) -> tuple[Locus, ...]:
    """Return every place with what its freedom explains, the best first, that over time.

    With each freedom the parameters are fitted anew: those of the base were bent by what it lacks,
    and a place would have to explain the bending as well.
    """
    free = [
        (section, layer, freed(bench, base, layer)) for section, layer in places_of_freedom(bench)
    ]
    quiet = freed(bench, base).cost
    known = [one.cost for *_, one in free if np.isfinite(one.cost)]
    quiet = quiet if np.isfinite(quiet) else max(known, default=0.0)
    found = []
    for section, layer, one in free:
        if np.isfinite(one.cost):
            locus = locus_of(bench, section, layer, one)
            found.append(dataclasses.replace(locus, gain=quiet - one.cost))
    found.sort(key=lambda locus: -locus.gain)
    return tuple([over_time(bench, found[0]), *found[1:]] if found else [])


def unexplained(bench: Bench, base: Estimate, loci: Sequence[Locus]) -> float:
    """Return what the freedom of the best place gains [nats].

    What the base takes up with drifts as small as it may have counts little: a model has some
    disturbance. All the same a load that acts on the road is one of these.
    """
    gain = max((locus.gain for locus in loci), default=0.0)
    taken_up = min(max(0.0, freed(bench, base).cost - base.cost), gain)
    return (gain - (1.0 - DISTURBED) * taken_up) / inflation(base, bench.series)


def places_of_freedom(bench: Bench) -> list[tuple[str, Layer]]:
    """Return a drift for each balance of forces, each elastic element, each compared output."""
    loci = [("flow", layer) for layer in bench.drifts]
    elements = bench.document.root.get("elements")
    for entry in elements if isinstance(elements, Table) else ():
        if bench.automaton.elements[entry.key].kind == "elastic":
            loci.append(("elements", drift("element", entry.key)))
    loci += [("outputs", drift("output", name)) for name in bench.seen]
    return loci


def led_by(loci: Sequence[Locus], paths: Sequence[str], bench: Bench) -> tuple[Locus, ...]:
    """Return places in which those of accepted effects lead, each with what is known there."""
    known = {locus.path: locus for locus in loci}
    first: list[Locus] = []
    for path in dict.fromkeys(paths):
        section, _, place = path.partition(".")
        nearest = known.get(path) or known.get(acting(bench, section, place))
        found = nearest or Locus(section, place, 0.0, 0.0)
        found = found if first else over_time(bench, found)
        first.append(dataclasses.replace(found, section=section, place=place, named=True))
    return (*first, *(locus for locus in loci if locus.path not in paths))


def likely(loci: Sequence[Locus], nearest: Iterable[str], bench: Bench) -> tuple[Locus, ...]:
    """Return places of something unknown, led by an input or a body that acts at the first one.

    What it does over time tells which; else `nearest`, the paths of what comes nearest to what is
    missing and gains enough, best first.
    """
    if not loci:
        return ()
    known = (path for path in nearest if not rests(bench, loci[0], path))
    for path in (*actors(bench, loci[0]), *known):
        section, _, place = path.partition(".")
        if acting(bench, section, place) == loci[0].path:
            first = dataclasses.replace(loci[0], section=section, place=place)
            return tuple(loci) if path == loci[0].path else (first, *loci)
    return tuple(loci)
