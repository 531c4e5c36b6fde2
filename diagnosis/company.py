"""Company: effects that were accepted beside the first one where that acts.

They take up what its form gets wrong. Physics does come in pairs; but so does what imitates an
effect that the library lacks.
"""

from __future__ import annotations

import dataclasses
import math

from diagnosis.bench import Bench
from diagnosis.layers import has_parameters
from diagnosis.location import acting
from diagnosis.naming import place_path
from diagnosis.search import Tried
from diagnosis.selection import Selection

IN_COMPANY = 0.8
"""Probability that the first name has at most with company: of 70 such names nine in ten were right
where the library had the effect, and none where it was taken out, a fourth as often."""


OUTDONE = 2.0
"""Times what the first effect gained that a hidden input gains where that acts, from which on the
effect is not what is missing: right ones gained more than it, wrong ones a tenth."""


def company_of(bench: Bench, selection: Selection) -> tuple[Tried, ...]:
    """Return what was accepted beside the first effect at its place, or where that acts."""
    first, *others = selection.accepted
    return tuple(one for one in others if _where(bench, first) & _where(bench, one))


def has_hidden(selection: Selection) -> bool:
    """Tell whether an input that explains anything at all was accepted."""
    return any(_is_hidden(tried) for tried in selection.accepted)


def is_outdone(bench: Bench, selection: Selection) -> bool:
    """Tell whether a hidden input explains much more than the first effect, where that acts."""
    first = selection.accepted[0]
    hidden = (one for one in company_of(bench, selection) if _is_hidden(one))
    return not _is_hidden(first) and any(_gain(one) > OUTDONE * _gain(first) for one in hidden)


def in_company(bench: Bench, selection: Selection) -> Selection:
    """Return a selection in which a first effect with company is less sure."""
    scores = [tried.score for tried in selection.first_round if tried.evidence]
    if not scores or not company_of(bench, selection):
        return selection
    apart = 2.0 * math.log(IN_COMPANY / (1.0 - IN_COMPANY))  # weights are those of Selection
    return dataclasses.replace(selection, other=max(selection.other, max(scores) - apart))


def _is_hidden(tried: Tried) -> bool:
    return not has_parameters(tried.layer)


def _where(bench: Bench, tried: Tried) -> set[str]:
    section, _, place = (path := place_path(tried.layer)).partition(".")
    return {path, acting(bench, section, place)}


def _gain(tried: Tried) -> float:
    return tried.evidence.train if tried.evidence else 0.0
