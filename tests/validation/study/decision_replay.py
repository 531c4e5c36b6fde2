"""Decision replay: the probabilities of a verdict from stored numbers, for other constants.

The posterior masses are those of the product (`log_form_weight`); its constants are replaced while
it is called.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import numpy as np

from diagnosis.criterion import explained_share
from diagnosis.criterion.threshold import DEFAULT_THRESHOLD
from tests.validation.study.case_score import Answer

OTHER, NOTHING = "other", "nothing_missing"
MIN_PROBABILITY = 0.01
"""Least probability of a score: a verdict without a probability counts as 99 % certain."""
GROUPS = ("full", "weak", "removed", "clean")
"""Groups with at most one effect: the first comparison decides."""


@dataclass(frozen=True)
class Constants:
    """The constants that data decide; the defaults are those of the product."""

    form_error: float = explained_share.FORM_ERROR
    form_samples: float = explained_share.FORM_SAMPLES
    max_ordinary_energy: float = explained_share.MAX_ORDINARY_ENERGY


@contextmanager
def use_constants(constants: Constants) -> Iterator[None]:
    """Give the criterion of the product other constants."""
    with patch.multiple(
        explained_share,
        FORM_ERROR=constants.form_error,
        FORM_SAMPLES=constants.form_samples,
        MAX_ORDINARY_ENERGY=constants.max_ordinary_energy,
    ):
        yield


def verdict_probabilities(decision: Mapping[str, Any]) -> dict[str, float]:
    """Return the probabilities of names, of `other` and of `nothing_missing` for stored numbers.

    If no candidate gains and explains enough and the energy is ordinary, nothing is missing with
    certainty; else the masses of the comparison count.
    """
    candidates = decision["candidates"]
    threshold = DEFAULT_THRESHOLD + _negligible_gain(decision)
    is_named = any(
        (one["gain"] or 0.0) >= threshold
        and (one["share"] or 0.0) >= explained_share.least_share(parameters=one["parameters"])
        for one in candidates
    )
    energy = math.inf if decision["energy"] is None else decision["energy"]
    if not is_named and explained_share.is_ordinary(energy, decision["channels"]):
        return {NOTHING: 1.0}
    sampled = decision["sampled_energy"] or 0.0
    names = [OTHER, *(one["id"] for one in candidates)]
    weights = [
        explained_share.log_form_weight(None, sampled),
        *(
            explained_share.log_form_weight(1.0 - (one["share"] or 0.0), sampled, one["parameters"])
            for one in candidates
        ),
    ]
    masses = np.exp(np.array(weights) - max(weights))
    found: dict[str, float] = {}
    for name, mass in zip(names, masses / masses.sum(), strict=True):
        found[name] = found.get(name, 0.0) + float(mass)
    return found


def _negligible_gain(decision: Mapping[str, Any]) -> float:
    """Return the gain [nats] of a model that explains a negligible energy.

    The number of independent samples is the sampled energy over the energy of a channel.
    """
    energy, sampled = decision["energy"], decision["sampled_energy"]
    samples = sampled * decision["channels"] / energy if energy and sampled else 0.0
    return explained_share.negligible_gain(samples)


def log_score(answer: Answer) -> float:
    """Return the logarithm of the probability that the verdict gives to what is true."""
    found = verdict_probabilities(answer.decision)
    if answer.group == "clean":
        right = {NOTHING}
    elif answer.group == "removed":
        right = {OTHER}
    else:
        right = set(answer.right())
    return math.log(max(sum(found.get(name, 0.0) for name in right), MIN_PROBABILITY))


def mean_score(answers: Sequence[Answer], constants: Constants) -> dict[str, float]:
    """Return the mean logarithmic score of each generator for constants."""
    with use_constants(constants):
        scores: dict[str, list[float]] = {}
        for one in answers:
            scores.setdefault(one.generator, []).append(log_score(one))
    return {name: float(np.mean(some)) for name, some in scores.items()}


def replayable(answers: Sequence[Answer]) -> list[Answer]:
    """Return the answers that have the numbers of a decision, with at most one visible effect."""
    return [one for one in answers if one.group in GROUPS and one.decision and one.is_visible]
