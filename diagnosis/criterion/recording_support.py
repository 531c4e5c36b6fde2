"""Share: how much of what an effect gains counts, by how many recordings have a share in it.

Physics acts wherever it is stirred. What one recording gains alone is more often an accident of it.
"""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.criterion.likelihood_gain import LikelihoodGain

FEW_RECORDINGS = 3
"""Recordings of which none can be against all others."""
MIN_SHARED_FRACTION = 0.2
"""The part of what an effect gains that must be left without the recording that gains most."""
SINGLE_RECORDING_FACTOR = 10.0
"""Times the threshold that is enough where less than that is left: of 760 first names that two
studies had right none left so little and gained less, two imitations did."""
OPPOSED_FACTOR = 3.0
"""The same where one recording denies what all others show, and where there are few."""


def supported_gain(
    gain: LikelihoodGain,
    cross_validated_fraction: float = 1.0,
    single_recording_factor: float = SINGLE_RECORDING_FACTOR,
) -> float:
    """Return what an effect gains [nats] as it counts: less where one recording is against all.

    What one recording gains `single_recording_factor` is divided by that. One that denies what all others show may be
    the only one that tells how large it is. `cross_validated_fraction` is the part of the threshold that is asked
    for what is left out.
    """
    gained = min(gain.penalised, gain.cross_validated / cross_validated_fraction)
    if len(gain.by_recording) < FEW_RECORDINGS:
        return discount_unsupported(
            gained, gain.by_recording, min(single_recording_factor, OPPOSED_FACTOR)
        )
    whole = discount_unsupported(gained, gain.by_recording, single_recording_factor)
    others = sorted(gain.by_recording)[1:]
    gained = min(gain.penalised, sum(others) / cross_validated_fraction)
    return max(
        whole, discount_unsupported(gained, others, single_recording_factor) / OPPOSED_FACTOR
    )


def discount_unsupported(
    gain: float, gains: Sequence[float], single_recording_factor: float = SINGLE_RECORDING_FACTOR
) -> float:
    """Return what is `gain` [nats], less where recordings do not share it: `gains` is what it has
    left out.
    """
    total = sum(gains)
    is_shared = len(gains) == 1 or total - max(gains) > MIN_SHARED_FRACTION * total
    return gain if is_shared or gain < 0.0 else gain / single_recording_factor


def ranking_gain(
    gain: LikelihoodGain, single_recording_factor: float = SINGLE_RECORDING_FACTOR
) -> float:
    """Return what an effect is ranked by [nats]: what it gained where it was fitted, and what it
    gains as it counts.
    """
    return gain.penalised + supported_gain(gain, single_recording_factor=single_recording_factor)
