"""Hidden: an unknown force or torque that acts in windows: a brake, a pulse, a hit.

Found as a drift that is let free at a balance (see freedom). It takes no parameters to explain
anything at all: it is named only where it is silent most of the time.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from diagnosis.bench import Bench
from diagnosis.estimation import Estimate, estimated, with_normal
from diagnosis.evidence import evidence, inflation
from diagnosis.freedom import SMALL_LEVEL, freed, with_levels
from diagnosis.layers import DRIFT, Layer, fitting
from diagnosis.level import units_of
from diagnosis.locus import Locus
from diagnosis.search import Tell, Tried
from diagnosis.selection import Selection, counted

MOST = 0.8
"""Part of the squares of a drift that its loudest samples have."""
SHORT = 0.22
"""Part of all samples that these are at most, of what acts in windows."""
KNOWN = 0.8
"""Correlation with something known from which on an input is not hidden: it follows that."""
LITTLE = 0.5
"""Part of what it gains that effects explain less of, if it is to stand for them."""
ROUNDS = 5
"""Rounds in which what was accepted is fitted without drifts."""


def with_hidden(
    bench: Bench,
    selection: Selection,
    loci: Sequence[Locus],
    needed: float,
    tell: Tell = lambda text: None,
) -> Selection:
    """Return a selection in which a hidden input stands for effects that explain less than it.

    Gains are those over the base without drifts, of which the base as it is may have taken its
    part. `needed` are the nats that it must gain at least.
    """
    base = selection.base
    shrink = 1.0 / inflation(base, bench.series)
    loud = [one for one in loci if _layer(bench, one) and shrink * one.gain > needed]
    if not loud or any(abs(r) > KNOWN for _, r in loud[0].along):
        return selection
    locus, quiet = loud[0], freed(bench, base)
    drift = next(d for d in bench.drifts if d.place == locus.place)
    model = with_normal(freed(bench, base, drift), bench.series)
    if not acts_in_windows(model, drift.named(DRIFT)):
        return selection
    if selection.accepted:
        without = _quieted(bench, selection.model)
        if quiet.cost - without.cost > LITTLE * (quiet.cost - model.cost):
            return selection
    known, layer = evidence(model, quiet, bench.series), _layer(bench, locus)
    if layer is None or counted(known) < needed:
        return selection
    tell(f"accepted {layer.id}: {known.least:.0f} nats, silent most of the time")
    found = Tried(layer, quiet.cost - model.cost, model, known)
    first = (found, *selection.first_round)
    return dataclasses.replace(
        selection, base=quiet, model=model, accepted=(found,), first_round=first, rivals=()
    )


def _quieted(bench: Bench, model: Estimate) -> Estimate:
    """Return a model fitted with next to no drift: what it explains without."""
    units = units_of(model.candidate, bench.series, model.noises, model.values(0))
    noises = with_levels(model.noises, units, dict.fromkeys(units, SMALL_LEVEL))
    return estimated(model.candidate, bench.series, noises, model.point, ROUNDS)


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
