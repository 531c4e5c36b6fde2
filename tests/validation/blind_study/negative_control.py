"""Control: what a score is when it should be nothing, and what simpler methods reach."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from statistics import fmean

from tests.validation.blind_study.case_score import NOTHING, Answer
from tests.validation.blind_study.proportion import Rate, rate_of

TIMES = 100
"""Permutations of the labels."""


def permutation_score(full: Sequence[Answer], draw: random.Random) -> float:
    """Return the mean share of first names that are right against labels in another order."""
    labels = [one.label for one in full]
    shares = []
    for _ in range(TIMES):
        draw.shuffle(labels)
        pairs = zip(full, labels, strict=True)
        shares.append(rate_of(replace(one, label=label).is_named for one, label in pairs).share)
    return fmean(shares)


def majority_rate(full: Sequence[Answer]) -> Rate:
    """Return how often the most frequent label would be right."""
    counts = Counter(one.true for one in full)
    return Rate(max(counts.values(), default=0), len(full))


def baseline_rate(full: Sequence[Answer], method: str) -> Rate:
    """Return how often a simpler method (see baseline) names a true effect."""
    return rate_of(one.simpler.get(method) in one.ids for one in full)


def baseline_alarm_rate(clean: Sequence[Answer], method: str) -> Rate:
    """Return how often a simpler method names an effect where nothing is missing."""
    return rate_of(one.simpler.get(method) != NOTHING for one in clean)
