"""Adequacy: whether effects that were accepted leave more unexplained than they explain.

The nearest effect of a library that lacks the true one gains a great deal; but with the parameters
held, a drift that is let free at some place still finds much to do beside it.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from diagnosis.bench import Bench
from diagnosis.estimation import looked_at
from diagnosis.evidence import inflation
from diagnosis.freedom import WIDE_LEVELS, with_levels
from diagnosis.layers import DRIFT, Layer, has_parameters, walks
from diagnosis.level import units_of
from diagnosis.location import places_of_freedom
from diagnosis.point import extended
from diagnosis.selection import Selection
from language.problem import SpecError

LEFT_PART = 0.5
"""Part of what was gained that a freedom may gain beside it: forms differ, and noise has colour.

An error of an output is none of them: a sensor follows whatever the model gets wrong."""

UNLIKELY = 20.0
"""Nats by which "none of these" then leads the best candidate."""


def is_inadequate(bench: Bench, selection: Selection, needed: float) -> bool:
    """Tell whether a freedom gains much of what the accepted effects gained, and what is `needed`.

    A hidden input is a freedom itself: it leaves what it leaves. So does an effect that may walk
    along a recording, such as a grade, at its own place.
    """
    known = [tried.evidence.train for tried in selection.accepted if tried.evidence]
    if not known or any(not has_parameters(tried.layer) for tried in selection.accepted):
        return False
    limit = max(needed, LEFT_PART * sum(known)) * inflation(selection.model, bench.series)
    walking = {tried.layer.place for tried in selection.accepted if walks(tried.layer)}
    return any(
        _gains(bench, selection, layer, limit)
        for section, layer in places_of_freedom(bench)
        if section == "elements" or (section == "flow" and layer.place not in walking)
    )


def refused(selection: Selection) -> Selection:
    """Return a selection in which nothing was accepted, and no candidate is likely."""
    totals = [tried.evidence.total for tried in selection.first_round if tried.evidence]
    other = max(selection.other, *totals) + UNLIKELY
    return dataclasses.replace(selection, model=selection.base, accepted=(), rivals=(), other=other)


def _gains(bench: Bench, selection: Selection, layer: Layer, limit: float) -> bool:
    """Tell whether the freedom of a drift gains more than a limit [nats], parameters held."""
    model = selection.model
    is_known = any(layer.id == one.id for one in bench.drifts)
    drifts = bench.drifts if is_known else (*bench.drifts, layer)
    try:
        candidate = bench.candidate([tried.layer for tried in selection.accepted], drifts)
    except SpecError:
        return False
    units = units_of(candidate, bench.series, model.noises, model.values(0))
    point = extended(candidate, model.candidate, model.point, {})
    quiet = looked_at(candidate, bench.series, model.noises, point)
    for level in WIDE_LEVELS if np.isfinite(quiet.cost) else ():
        noises = with_levels(model.noises, units, {layer.named(DRIFT): level})
        free = looked_at(candidate, bench.series, noises, point, quiet.outcome)
        if quiet.cost - free.cost > limit:
            return True
    return False
