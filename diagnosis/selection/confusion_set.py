"""Confusion set: candidates that recordings do not separate from the accepted effect."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.selection.candidate_search import CandidateFit

CONFUSION_GAIN = 20.0
"""Candidates whose scores differ by less [nats] cannot be told apart by these recordings."""
CONFUSION_FRACTION = 0.9
"""Part of what the best candidate gains from which on another one gains nearly as much: forms that
are not quite those of the car differ by more than a tenth."""


def confusion_set(
    first_round: Sequence[CandidateFit], accepted: Sequence[CandidateFit]
) -> tuple[CandidateFit, ...]:
    """Return fitted candidates that are confusable with the first accepted one or gain nearly as
    much.

    The set is empty without an accepted effect.
    """
    if not accepted or accepted[0].likelihood_gain is None:
        return ()
    ids = {tried.placed_effect.id for tried in accepted}
    near = {tried.placed_effect.id for tried in near_best(first_round)}
    others = (
        tried
        for tried in first_round
        if tried.likelihood_gain and tried.placed_effect.id not in ids
    )
    return tuple(o for o in others if is_confusable(o, accepted[0]) or o.placed_effect.id in near)


def is_confusable(candidate_fit: CandidateFit, best: CandidateFit) -> bool:
    """Return whether the score of a candidate is within `CONFUSION_GAIN` of the best one."""
    return candidate_fit.score > best.score - CONFUSION_GAIN


def near_best(candidate_fits: Sequence[CandidateFit]) -> tuple[CandidateFit, ...]:
    """Return the candidates with a positive gain of nearly the largest one, in their order."""
    fitted = [
        (tried, tried.likelihood_gain.penalised)
        for tried in candidate_fits
        if tried.likelihood_gain
    ]
    most = max((gain for _, gain in fitted), default=0.0)
    return tuple(
        tried for tried, gain in fitted if gain > 0.0 and gain >= CONFUSION_FRACTION * most
    )
