"""Ways: the base recalibrated with inputs held from sample to sample, and straight in between.

Which one a recording asks for cannot always be told before something missing is found: half a
sample is a delay as well.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import partial

from diagnosis.bench import Bench
from diagnosis.estimate import Estimate
from diagnosis.level import first_fit, recalibrated, settled, units_of
from diagnosis.point import extended
from diagnosis.search import Tell, Tried
from diagnosis.selection import Selection, selected
from diagnosis.series import paced, require_one_pace
from diagnosis.starting import settled_at_start, started
from diagnosis.threshold import Thresholds

Way = tuple[Bench, Estimate]


def ways_of(bench: Bench, tell: Tell = lambda text: None) -> list[Way]:
    """Return benches of paced recordings with their recalibrated bases, to be tried in turn.

    With inputs that run straight between samples the truth is reached sooner; held ones are tried
    beside it where the base alone is better with them.
    """
    firsts = []
    for is_linear in (True, False):
        paced_ones = paced(bench.series, bench.automaton, bench.seen, is_linear)
        require_one_pace(paced_ones)
        own = tuple(settled_at_start(one) for one in paced_ones)
        way = dataclasses.replace(bench, series=own)
        candidate = way.candidate(())
        units = units_of(candidate, own, {})
        make = partial(first_fit, candidate, own, units)
        first = way.kept("first fit", candidate, [units], make)
        way = dataclasses.replace(way, series=started(first, own))
        firsts.append((way, first, units))
    straight, held = firsts
    if straight[1].likelihood <= held[1].likelihood:
        firsts = [straight]
    found = []
    for way, first, units in firsts:
        make = partial(recalibrated, first, way.series, units)
        given = [first.point, first.noises, units]
        found.append((way, way.kept("recalibrated", first.candidate, given, make)))
    for way, base in found:
        text = "straight between samples" if way.series[0].is_linear else "held"
        tell(f"recalibrated, inputs {text}: {base.cost:.0f} nats")
    is_straight = better_way(found)[0].series[0].is_linear
    return found[:1] if is_straight else found


def better_way(ways: Sequence[Way]) -> Way:
    """Return the way whose base foresees the recordings better."""
    return min(ways, key=lambda way: way[1].likelihood)


def chosen(
    ways: Sequence[Way], thresholds: Thresholds, tell: Tell = lambda text: None
) -> tuple[Bench, Estimate, Selection]:
    """Return the way in which the recordings are foreseen best with what is missing, and that.

    Where something was accepted in one way another is gone only if that fits better there.
    """
    found: list[tuple[float, Bench, Estimate, Selection]] = []
    known: tuple[Tried, ...] = ()
    for bench, base in ways:
        if any(not _fits_better(bench, base, selection) for *_, selection in found):
            continue
        units = units_of(base.candidate, bench.series, base.values(0))
        selection = selected(bench, base, units, thresholds, tell, known=known)
        known = selection.first_round if selection.accepted else ()
        cost = selection.model.cost + thresholds.usual * len(selection.accepted)
        found.append((cost, bench, base, selection))
    _, bench, base, selection = min(found, key=lambda one: one[0])
    return bench, base, selection


def _fits_better(bench: Bench, base: Estimate, selection: Selection) -> bool:
    """Tell whether what was accepted in another way fits better in this one; nothing may."""
    candidate = bench.possible([tried.layer for tried in selection.accepted])
    if candidate is None or not selection.accepted:
        return True
    model = selection.model
    units = units_of(base.candidate, bench.series, base.values(0))
    start = extended(candidate, model.candidate, model.point, {})
    given = (model.noises, start, units)
    make = partial(settled, candidate, bench.series, *given)
    return bench.kept("settled", candidate, given, make).cost < model.cost
