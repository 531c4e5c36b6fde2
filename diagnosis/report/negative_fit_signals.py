"""Negative fit signals: signals whose free simulation is worse than a constant."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence

from diagnosis.result.verdict import Verdict

CONSTANT_MODEL_NRMSE = 1.0
"""Normalised error of the mean of a recorded signal."""


def unfollowed_signals(verdict: Verdict) -> Iterator[str]:
    """Yield a message for each signal whose misfit is NaN or above `CONSTANT_MODEL_NRMSE`."""
    for part, signals in verdict.fit.items():
        for name, misfit in signals.items():
            share = misfit.nrmse_after
            if share > CONSTANT_MODEL_NRMSE or math.isnan(share):
                where = f"{part.replace('_', ' ')}: free simulation misses `{name}`"
                yield f"{where} by {100 * share:.0f} % of its spread, a constant by 100 %"


def withdraw_nothing_missing(verdict: Verdict, unfollowed: Sequence[str]) -> Verdict:
    """Return the verdict, `unknown` for `nothing_missing` with `unfollowed` signals."""
    if unfollowed and verdict.verdict == "nothing_missing":
        return dataclasses.replace(verdict, verdict="unknown")
    return verdict
