"""Hidden: an unknown force or torque that acts in windows: a brake, a pulse, a hit.

Found as a drift that is let free at a balance (see freedom). It takes no parameters to explain
anything at all: it is named only where it is silent most of the time.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from diagnosis.bench import Bench
from diagnosis.estimation import Estimate, with_normal
from diagnosis.evidence import evidence, inflation
from diagnosis.freedom import freed
from diagnosis.layers import DRIFT, Layer, fitting
from diagnosis.locus import Locus
from diagnosis.search import Tell, Tried
from diagnosis.selection import Selection

MOST = 0.8
"""Part of the squares of a drift that its loudest samples have."""
SHORT = 0.15
"""Part of all samples that these are at most, of what acts in windows."""
CLEARLY = 1.1
"""Times the gain of the best effect that it must gain."""


def with_hidden(
    bench: Bench,
    selection: Selection,
    loci: Sequence[Locus],
    needed: float,
    tell: Tell = lambda text: None,
) -> Selection:
    """Return a selection in which a hidden input stands for effects that explain less than it.

    `needed` are the nats that it must gain over the base at least.
    """
    base = selection.base
    best = max((t.evidence.train for t in selection.accepted if t.evidence), default=0.0)
    shrink = 1.0 / inflation(base, bench.series)
    for locus in loci:
        layer = _layer(bench, locus)
        if layer is None or shrink * locus.beyond < max(needed, CLEARLY * best):
            continue
        drift = next(d for d in bench.drifts if d.place == locus.place)
        model = with_normal(freed(bench, base, drift), bench.series)
        if not acts_in_windows(model, drift.named(DRIFT)):
            continue
        known = evidence(model, base, bench.series)
        if known.least > max(needed, CLEARLY * best):
            tell(f"accepted {layer.id}: {known.least:.0f} nats, silent most of the time")
            found = Tried(layer, base.cost - model.cost, model, known)
            first = (found, *selection.first_round)
            return dataclasses.replace(
                selection, model=model, accepted=(found,), first_round=first, rivals=()
            )
    return selection


def acts_in_windows(model: Estimate, name: str) -> bool:
    """Tell whether a drift is silent most of the time."""
    place = model.candidate.predictor.states.index(name)
    squares = np.concatenate(
        [one.states[: one.done, place] ** 2 for one in model.outcome.predictions]
    )
    whole = np.cumsum(np.sort(squares)[::-1])
    loudest = int(np.searchsorted(whole, MOST * whole[-1])) + 1
    return loudest < SHORT * len(squares)


def _layer(bench: Bench, locus: Locus) -> Layer | None:
    """Return the input without parameters that the library knows for a balance."""
    known: Mapping[str, Layer] = {
        layer.place: layer
        for effect in bench.effects
        if effect.body.get("parameters") is None
        for layer in fitting(bench.document, effect)
    }
    is_balance = locus.section == "flow" and any(d.place == locus.place for d in bench.drifts)
    return known.get(locus.place) if is_balance else None
