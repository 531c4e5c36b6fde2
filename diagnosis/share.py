"""Share: how much of what an effect gains counts, by how many recordings have a share in it.

Physics acts wherever it is stirred. What one recording gains alone is more often an accident of it.
"""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.evidence import Evidence

FEW = 3
"""Recordings of which none can be against all others."""
SHARED = 0.2
"""The part of what an effect gains that must be left without the recording that gains most."""
ALONE = 10.0
"""Times the threshold that is enough where less than that is left: of 760 first names that two
studies had right none left so little and gained less, two imitations did."""
AGAINST = 3.0
"""The same where one recording denies what all others show, and where there are few."""


def counted(known: Evidence, left_out: float = 1.0, alone: float = ALONE) -> float:
    """Return what an effect gains [nats] as it counts: less where one recording is against all.

    What one recording gains `alone` is divided by that. One that denies what all others show may be
    the only one that tells how large it is. `left_out` is the part of the threshold that is asked
    for what is left out.
    """
    gained = min(known.train, known.left_out / left_out)
    if len(known.each) < FEW:
        return as_shared(gained, known.each, min(alone, AGAINST))
    whole = as_shared(gained, known.each, alone)
    others = sorted(known.each)[1:]
    gained = min(known.train, sum(others) / left_out)
    return max(whole, as_shared(gained, others, alone) / AGAINST)


def as_shared(gained: float, each: Sequence[float], alone: float = ALONE) -> float:
    """Return what is `gained` [nats], less where recordings do not share it: `each` is what it has
    left out.
    """
    total = sum(each)
    is_shared = len(each) == 1 or total - max(each) > SHARED * total
    return gained if is_shared or gained < 0.0 else gained / alone


def ranked(known: Evidence, alone: float = ALONE) -> float:
    """Return what an effect is ranked by [nats]: what it gained where it was fitted, and what it
    gains as it counts.
    """
    return known.train + counted(known, alone=alone)
