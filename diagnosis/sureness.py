"""Sureness: a first name that may be an imitation is less sure than its gain makes it."""

from __future__ import annotations

import dataclasses
import math

from diagnosis.bench import Bench
from diagnosis.company import company_of
from diagnosis.constancy import varies
from diagnosis.search import Tell
from diagnosis.selection import Selection

UNSURE = 0.8
"""Probability that a first name then has at most: of 70 names in company nine in ten were right
where the library had the effect, and none where it was taken out, a fourth as often."""


def less_sure(bench: Bench, selection: Selection, tell: Tell) -> Selection:
    """Return a selection whose first effect is less sure if it has company or its parameters vary
    from recording to recording.
    """
    scores = [tried.score for tried in selection.first_round if tried.evidence]
    why = _why(bench, selection)
    if not scores or not why:
        return selection
    tell(f"less sure: {selection.accepted[0].layer.id}: {why}")
    apart = 2.0 * math.log(UNSURE / (1.0 - UNSURE))  # weights are those of Selection
    return dataclasses.replace(selection, other=max(selection.other, max(scores) - apart))


def _why(bench: Bench, selection: Selection) -> str:
    """Return why the first effect may be an imitation; nothing where it seems not to be."""
    if varies(selection.model, selection.accepted[0], bench.series):
        return "its parameters are not the same in each recording"
    if company_of(bench, selection):
        return "others act where it does"
    return ""
