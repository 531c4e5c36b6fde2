"""Doubt: when a formula is tried beside the effects of the library, and when it is the verdict.

The nearest effect of a library that lacks the true one gains a great deal: what it leaves over
tells that it is not the right one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from diagnosis.actor import acting
from diagnosis.bench import Bench
from diagnosis.description import Description
from diagnosis.excess import excess_at
from diagnosis.naming import place_path
from diagnosis.regression import ranking
from diagnosis.search import Tried
from diagnosis.selection import Selection
from diagnosis.share import ranked
from diagnosis.verdict import Says
from language.problem import SpecError

UNEXPLAINED = 2.5
"""Times the threshold that the freedom of a place gains where a formula is tried."""
LEFT = 2.0
"""Times the threshold that a term gains where an accepted effect leaves something over."""
LEFT_PART = 0.3
"""And this part of what the effect gained: a strong one is never described quite well."""
MUCH_OVER = 0.8
"""Part of what accepted effects gained that a term at their place gains beside them, from which on
they are something else: the right ones left a third of it at most."""
STILL = 0.5
"""Units of its drifts below which a model with what was accepted needs none."""
MORE = 1.5
"""A formula is the verdict where it gains so many times as much as what was accepted."""


def is_doubtful(
    says: Says, selection: Selection, left: float, over: float, threshold: float
) -> bool:
    """Tell whether a formula might say more than the verdict does.

    `left` is what the base leaves unexplained [nats], `over` what accepted effects leave.
    """
    if says in ("unknown", "ambiguous"):
        return True
    if says == "nothing_missing":
        return left > UNEXPLAINED * threshold
    return over > max(LEFT * threshold, LEFT_PART * _gained(selection))


def leaves_much(selection: Selection, over: float, threshold: float) -> bool:
    """Tell whether accepted effects leave over much of what they gained: they are not what is
    missing, whether or not a formula is found that says more.
    """
    return over > max(threshold, MUCH_OVER * _gained(selection))


def _gained(selection: Selection) -> float:
    return sum(tried.evidence.train for tried in selection.accepted if tried.evidence)


def is_still(selection: Selection, units: Mapping[str, float]) -> bool:
    """Tell whether a model with what was accepted needs no drift."""
    drifts = selection.model.noises.drifts
    return all(drifts.get(name, 0.0) < STILL * unit for name, unit in units.items())


def left_over(bench: Bench, selection: Selection, units: Mapping[str, float]) -> float:
    """Return what the best term gains [nats] where effects were accepted, beside them; nothing
    where the model needs no drift.
    """
    most, model = 0.0, selection.model
    if is_still(selection, units):
        return most
    paths = [place_path(tried.layer).partition(".") for tried in selection.accepted]
    for path in {acting(bench, section, place) for section, _, place in paths}:
        section, _, place = path.partition(".")
        try:
            excess = excess_at(bench, model, section, place)
        except SpecError:
            continue
        most = max(most, ranking(excess.problem, excess.columns)[0][0])
    return most


def explains_more(found: Description, selection: Selection) -> bool:
    """Tell whether a formula gains clearly more than all that was accepted."""
    gains = [ranked(tried.evidence) for tried in selection.accepted if tried.evidence]
    return ranked(found.evidence) > MORE * sum(gains)


def selected_formula(selection: Selection, found: Description) -> Selection:
    """Return a selection in which a formula is what was accepted, and no candidate is likely."""
    tried = Tried(found.formula.layer, found.evidence.train, found.estimate, found.evidence)
    return dataclasses.replace(
        selection,
        model=found.estimate,
        accepted=(tried,),
        rivals=(),
        other=max(selection.other, found.evidence.total),
    )
