"""Missed: signals that a model, as it was concluded, follows worse than a constant would."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence

from diagnosis.result.verdict import Verdict

CONSTANT_MODEL_NRMSE = 1.0
"""NRMSE of the mean of a recorded signal: a model that misses more shows nothing of it."""


def unfollowed_signals(verdict: Verdict) -> Iterator[str]:
    """Yield what free simulation misses by more than the spread of the signal, in words."""
    for part, signals in verdict.fit.items():
        for name, misfit in signals.items():
            share = misfit.nrmse_after
            if share > CONSTANT_MODEL_NRMSE or math.isnan(share):
                where = f"{part.replace('_', ' ')}: free simulation misses `{name}`"
                yield f"{where} by {100 * share:.0f} % of its spread, a constant by 100 %"


def withdraw_nothing_missing(verdict: Verdict, unfollowed: Sequence[str]) -> Verdict:
    """Return a verdict beside what it misses: where nothing was to be missing, something is."""
    if unfollowed and verdict.verdict == "nothing_missing":
        return dataclasses.replace(verdict, verdict="unknown")
    return verdict
