"""Recording support: the part of a gain that counts, by how many recordings contribute to it.

Physics acts in every recording that excites it. A gain in a single recording is more often a
chance.
"""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.criterion.likelihood_gain import LikelihoodGain

FEW_RECORDINGS = 3
"""With fewer recordings a single one cannot be outvoted."""
MIN_SHARED_FRACTION = 0.2
"""Fraction of a gain that must remain without the recording that gains most."""
SINGLE_RECORDING_FACTOR = 10.0
"""Divisor of a gain that comes from a single recording.

Of 760 right effects in two studies none had so little support and a smaller gain; two imitations
had.
"""
OPPOSED_FACTOR = 3.0
"""The same if one recording contradicts all others, and if there are few recordings."""


def supported_gain(
    gain: LikelihoodGain,
    cross_validated_fraction: float = 1.0,
    single_recording_factor: float = SINGLE_RECORDING_FACTOR,
) -> float:
    """Return the smaller gain [nats] of an effect, reduced if few recordings support it.

    A gain of one recording is divided by `single_recording_factor`. A recording that contradicts
    all others may be ignored at the price of `OPPOSED_FACTOR`. `cross_validated_fraction` is the
    fraction of the threshold that the cross-validated gain needs.
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
    """Return `gain`, divided by the factor if one recording has nearly all of `gains`.

    A negative gain, and the gain of a single recording, are returned unchanged.
    """
    total = sum(gains)
    is_shared = len(gains) == 1 or total - max(gains) > MIN_SHARED_FRACTION * total
    return gain if is_shared or gain < 0.0 else gain / single_recording_factor


def ranking_gain(
    gain: LikelihoodGain, single_recording_factor: float = SINGLE_RECORDING_FACTOR
) -> float:
    """Return the gain [nats] by which effects are ranked: the penalised plus the supported one."""
    return gain.penalised + supported_gain(gain, single_recording_factor=single_recording_factor)
