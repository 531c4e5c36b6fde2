"""Adequacy: whether effects that were accepted leave more unexplained than they explain.

The nearest effect of a library that lacks the true one gains a great deal; but drifts that are let
free still find much to do beside it, and innovations of the model remember, which noise does not.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from diagnosis.bench import Bench
from diagnosis.evidence import inflation, inflations
from diagnosis.layers import Layer, walks
from diagnosis.location import places_of_freedom
from diagnosis.naming import place_path
from diagnosis.room import drifts_gain
from diagnosis.selection import Selection
from diagnosis.simulation import nrmse

LEFT_PART = 0.12
"""Part of what was gained that drifts which are let free may gain beside it: forms differ."""
MEMORY = 1.2
"""Innovations that count as one from which on those of a model remember."""
HEARD = 1.6
"""The same from which on a name is taken back: a rate limit by steps has 1.54."""
MEMORY_PART = 0.25
"""Part of what the base's innovations remembered that those of an adequate model may: noise has no
memory, and a form that is not quite right leaves little of it."""
TYPICAL_PART = 0.2
"""The same for the recordings, for which it is the median: a few may be far from the others."""

LOUD, LOUD_PART = 3.0, 0.05
"""Innovations that count as one from which on those of a model are loud, and the typical part that
an adequate one may then leave: a sensor's lag that imitates its delay leaves a tenth."""

PILED = 0.35
"""Part of what an effect gained that a further one gains at the same place, where neither is it:
0.28 at most beside right ones."""

FAINT = 800.0
"""Nats that effects gained together below which simulations have to show them as well."""
HARDLY = 0.85
"""Part of the misfit of simulation from which on they hardly show them: what foresees a little
better from sample to sample and simulates no better is bent to what is there."""

UNLIKELY = 20.0
"""Nats by which "none of these" then leads the best candidate."""


def is_inadequate(bench: Bench, selection: Selection, needed: float) -> bool:
    """Tell whether free drifts gain much of what the accepted effects gained, and what is `needed`
    [nats].
    """
    known = [tried.evidence.train for tried in selection.accepted if tried.evidence]
    return freedom_gain(bench, selection) > max(needed, LEFT_PART * sum(known))


def freedom_gain(bench: Bench, selection: Selection) -> float:
    """Return what drifts that are let free in all balances and elements gain [nats], the parameters
    fitted with them; those of elements are left out where they do not go along.

    An effect that may walk along a recording, such as a grade, leaves what it leaves at its place.
    A free error of an output is none of them: a sensor follows whatever the model gets wrong.
    """
    inside = [layer for section, layer in places_of_freedom(bench) if section == "elements"]
    gains = (_gain(bench, selection, some) for some in ((*bench.drifts, *inside), bench.drifts))
    return next((gain for gain in gains if np.isfinite(gain)), np.inf)


def _gain(bench: Bench, selection: Selection, drifts: Sequence[Layer]) -> float:
    """Return what some drifts gain [nats] that are let free; -inf where they do not go along."""
    held = {tried.layer.place for tried in selection.accepted if walks(tried.layer)}
    gain = drifts_gain(bench, selection.model, drifts, held)
    return gain / inflation(selection.model, bench.series)


def remembers(bench: Bench, selection: Selection) -> bool:
    """Tell whether innovations remember much of what they did before effects were accepted."""
    before, after = (inflation(one, bench.series) for one in (selection.base, selection.model))
    return after > MEMORY and after - 1.0 > MEMORY_PART * (before - 1.0)


def remembers_mostly(bench: Bench, selection: Selection) -> bool:
    """Tell whether innovations remember, and those of most recordings in which they did before.

    Where a form is not quite right some recordings show it that drive it far.
    """
    together = inflation(selection.model, bench.series)
    is_loud = together > LOUD
    if together < HEARD or not (is_loud or remembers(bench, selection)):
        return False
    before, after = (inflations(one, bench.series) for one in (selection.base, selection.model))
    heard = before > MEMORY
    left = (after[heard] - 1.0) / (before[heard] - 1.0)
    return not heard.any() or float(np.median(left)) > (LOUD_PART if is_loud else TYPICAL_PART)


def piles_up(selection: Selection) -> bool:
    """Tell whether an effect needed another one at its place, which gains much of what it gained:
    together they imitate what is neither.
    """
    firsts: dict[str, float] = {}
    for tried in selection.accepted:
        path, gained = place_path(tried.layer), tried.evidence.train if tried.evidence else 0.0
        if path in firsts and gained > PILED * firsts[path]:
            return True
        firsts.setdefault(path, gained)
    return False


def hardly_shows(bench: Bench, selection: Selection) -> bool:
    """Tell whether effects that gained little leave simulations nearly as they were."""
    gained = sum(tried.evidence.train for tried in selection.accepted if tried.evidence)
    if gained > FAINT:
        return False
    before, after = (nrmse(one, bench.series) for one in (selection.base, selection.model))
    return float(np.mean(after / np.maximum(before, 1e-12))) > HARDLY


def refused(selection: Selection) -> Selection:
    """Return a selection in which nothing was accepted, and no candidate is likely."""
    totals = [tried.evidence.total for tried in selection.first_round if tried.evidence]
    other = max(selection.other, *totals) + UNLIKELY
    return dataclasses.replace(selection, model=selection.base, accepted=(), rivals=(), other=other)
