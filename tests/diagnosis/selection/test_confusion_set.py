"""Rivals: what may be it as well as the accepted effect, or comes nearest to an unknown one."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from diagnosis.criterion.likelihood_gain import LikelihoodGain
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.confusion_set import (
    CONFUSION_FRACTION,
    CONFUSION_GAIN,
    confusion_set,
    is_confusable,
    near_best,
)
from language.overlays.expand_document import Project
from tests.diagnosis.example_report import acceptable_layers, make_dossier

LEFT_OUT = 50.0
"""Gain on what was left out, the same for all: what was fitted decides."""


def tried(*gains: float | None) -> list[CandidateFit]:
    """Return candidates with so much gained where they were fitted [nats]; None: not fitted."""
    project = Project(Path())
    dossier = make_dossier(project, acceptable_layers(project)[: len(gains)])
    assert dossier.diagnosis
    found = dossier.diagnosis.selection.first_round
    made = [None if gain is None else LikelihoodGain(gain, LEFT_OUT, (LEFT_OUT,)) for gain in gains]
    return [dataclasses.replace(t, likelihood_gain=e) for t, e in zip(found, made, strict=True)]


def test_the_nearest_gain_nearly_as_much_as_the_best() -> None:
    best, near, far, unfitted = tried(
        200.0, 200.0 * CONFUSION_FRACTION, 199.0 * CONFUSION_FRACTION, None
    )
    assert near_best([far, best, unfitted, near]) == (best, near)


@pytest.mark.parametrize("gains", [(), (None,), (-3.0, -2.0)])
def test_none_is_near_where_nothing_gains(gains: tuple[float | None, ...]) -> None:
    assert near_best(tried(*gains) if gains else []) == ()


def test_rivals_are_close_or_gain_nearly_as_much_and_are_not_accepted() -> None:
    first, close, far, unfitted = tried(1000.0, 1000.0, 500.0, None)
    assert is_confusable(close, first) and not is_confusable(far, first)
    found = confusion_set([first, close, far, unfitted], [first])
    assert [one.placed_effect.id for one in found] == [close.placed_effect.id]
    assert confusion_set([first, close], [first, close]) == ()


def test_a_candidate_beyond_the_score_is_a_rival_where_it_gains_nearly_as_much() -> None:
    """0.95 of 1000 nats is 50 nats less: told apart by the score, and may be it as well."""
    first, other = tried(1000.0, 950.0)
    assert first.score - other.score > CONFUSION_GAIN
    assert confusion_set([first, other], [first]) == (other,)


def test_nothing_rivals_where_nothing_is_accepted() -> None:
    first, other = tried(1000.0, 950.0)
    assert confusion_set([first, other], []) == ()
    assert confusion_set([first, other], [dataclasses.replace(first, likelihood_gain=None)]) == ()
