"""Room: what drifts that are let free gain beside a model: about what further effects could.

A drift follows anything at its place, late. Where those that there are have little to do, and none
finds more when it is let free, no effect does.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from diagnosis.bench import Bench
from diagnosis.estimate import Estimate, looked_like
from diagnosis.evidence import inflation
from diagnosis.layers import DRIFT, Layer
from diagnosis.level import units_of
from diagnosis.location import places_of_freedom
from diagnosis.point import extended
from diagnosis.tuning import tuned
from language.problem import SpecError

FREE = 1000.0
"""Units that such a drift may have."""
LOUD = 1.6
"""Innovations that count as one from which on a model may be so far astray that drifts which are
let free do not find their way."""
HIGH = 0.5
"""Units of a drift from which on it may stand for an effect: free ones then gain nothing more, and
the effect gains what it explains better."""


def is_full(bench: Bench, model: Estimate, units: Mapping[str, float], needed: float) -> bool:
    """Tell whether a further effect cannot gain what is `needed` [nats].

    Drifts that lose much when they are let free did not find their way: they tell nothing.
    """
    drifts = model.noises.drifts
    is_low = all(drifts.get(name, 0.0) < HIGH * unit for name, unit in units.items())
    if not is_low or inflation(model, bench.series) >= LOUD:
        return False
    return abs(room_left(bench, model)) < needed


def room_left(bench: Bench, model: Estimate) -> float:
    """Return what drifts at all places gain [nats]: balances, elements and outputs, but for those
    where the model has effects if they do not go along with these; infinity where none do.
    """
    inside = [layer for section, layer in places_of_freedom(bench) if section != "flow"]
    taken = {layer.place for layer in model.candidate.layers}
    beside = [layer for layer in inside if layer.place not in taken]
    gains = (drifts_gain(bench, model, (*bench.drifts, *some)) for some in (inside, beside))
    return next((gain for gain in gains if np.isfinite(gain)), np.inf)


def drifts_gain(
    bench: Bench, model: Estimate, drifts: Sequence[Layer], held: Collection[str] = ()
) -> float:
    """Return what some drifts gain [nats] that are let free, but for those of `held` places; -inf
    where they do not go along.
    """
    try:
        candidate = bench.candidate(model.candidate.layers, drifts)
    except SpecError:
        return -np.inf
    units = units_of(candidate, bench.series, model.values(0))
    most = {layer.named(DRIFT): FREE for layer in drifts if layer.place not in held}
    point = extended(candidate, model.candidate, model.point, {})
    quiet = looked_like(candidate, bench.series, model.noises, point, model)
    found = tuned(quiet, bench.series, units, most)
    return model.cost - found.cost
