"""Rival: a candidate that may be it as well, or comes nearest where no effect is it."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.search import Tried

CLOSE = 20.0
"""Candidates whose scores differ by less [nats] cannot be told apart by these recordings."""
NEARLY = 0.9
"""Part of what the best candidate gains from which on another one gains nearly as much: forms that
are not quite those of the car differ by more than a tenth."""


def rivals(first_round: Sequence[Tried], accepted: Sequence[Tried]) -> tuple[Tried, ...]:
    """Return candidates that cannot be told from the first accepted one, or gain nearly as much as
    the best one.
    """
    if not accepted or accepted[0].evidence is None:
        return ()
    ids = {tried.layer.id for tried in accepted}
    near = {tried.layer.id for tried in nearest(first_round)}
    others = (tried for tried in first_round if tried.evidence and tried.layer.id not in ids)
    return tuple(o for o in others if is_close(o, accepted[0]) or o.layer.id in near)


def is_close(tried: Tried, best: Tried) -> bool:
    """Tell whether recordings cannot tell a candidate from the best one."""
    return tried.score > best.score - CLOSE


def nearest(some: Sequence[Tried]) -> tuple[Tried, ...]:
    """Return the candidates that gain nearly as much as the best of them, all where none gains."""
    fitted = [(tried, tried.evidence.train) for tried in some if tried.evidence]
    most = max((gain for _, gain in fitted), default=0.0)
    return tuple(tried for tried, gain in fitted if gain > 0.0 and gain >= NEARLY * most)
