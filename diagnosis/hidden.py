"""Hidden: an unknown force or torque that acts in windows: a brake, a pulse, a hit.

Found as a drift that is let free at a balance (see freedom). It takes no parameters to explain
anything at all: it is named only where it is silent most of the time.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.bench import Bench
from diagnosis.estimation import Estimate, estimated, with_normal
from diagnosis.evidence import evidence, inflation
from diagnosis.freedom import SMALL_LEVEL, freed, with_levels
from diagnosis.layers import Layer, fitting
from diagnosis.level import units_of
from diagnosis.locus import Locus, drifts_of
from diagnosis.search import Tell, Tried
from diagnosis.selection import Selection, counted

Reals = NDArray[np.float64]
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
    shrink = 1.0 / inflation(selection.base, bench.series)
    known = _inputs(bench)
    loud = [one for one in loci if one.path in known and shrink * one.gain > needed]
    if not loud or any(abs(r) > KNOWN for _, r in loud[0].along):
        return selection
    locus, layer = loud[0], known[loud[0].path]
    assert locus.free is not None, "a locus with a gain was let free"
    if not acts_in_windows(drifts_of(bench.series, locus.free, locus.drift)):
        return selection
    quiet, model = freed(bench, selection.base), with_normal(locus.free, bench.series)
    if selection.accepted:
        without = _quieted(bench, selection.model)
        if quiet.cost - without.cost > LITTLE * (quiet.cost - model.cost):
            return selection
    gained = evidence(model, quiet, bench.series)
    if counted(gained) < needed:
        return selection
    tell(f"accepted {layer.id}: {counted(gained):.0f} nats, silent most of the time")
    found = Tried(layer, quiet.cost - model.cost, model, gained)
    first = (found, *selection.first_round)
    return dataclasses.replace(
        selection, base=quiet, model=model, accepted=(found,), first_round=first, rivals=()
    )


def _quieted(bench: Bench, model: Estimate) -> Estimate:
    """Return a model fitted with next to no drift: what it explains without."""
    units = units_of(model.candidate, bench.series, model.noises, model.values(0))
    noises = with_levels(model.noises, units, dict.fromkeys(units, SMALL_LEVEL))
    return estimated(model.candidate, bench.series, noises, model.point, ROUNDS)


def acts_in_windows(drifts: Sequence[Reals]) -> bool:
    """Tell whether a drift is silent most of the time."""
    squares = np.concatenate(drifts) ** 2
    whole = np.cumsum(np.sort(squares)[::-1])
    loudest = int(np.searchsorted(whole, MOST * whole[-1])) + 1
    return loudest < SHORT * len(squares)


def _inputs(bench: Bench) -> dict[str, Layer]:
    """Return, by path, the inputs without parameters that the library knows for balances."""
    balances = {drift.place for drift in bench.drifts}
    return {
        f"flow.{layer.place}": layer
        for effect in bench.effects
        if effect.body.get("parameters") is None
        for layer in fitting(bench.document, effect)
        if layer.place in balances
    }
