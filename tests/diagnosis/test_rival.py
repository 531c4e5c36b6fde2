"""Rivals: what may be it as well as the accepted effect, or comes nearest to an unknown one."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from diagnosis.evidence import Evidence
from diagnosis.rival import CLOSE, NEARLY, is_close, nearest, rivals
from diagnosis.search import Tried
from language.project import Project
from tests.diagnosis.accepting import acceptable, accepted

LEFT_OUT = 50.0
"""Gain on what was left out, the same for all: what was fitted decides."""


def tried(*gains: float | None) -> list[Tried]:
    """Return candidates with so much gained where they were fitted [nats]; None: not fitted."""
    project = Project(Path())
    dossier = accepted(project, acceptable(project)[: len(gains)])
    assert dossier.diagnosis
    found = dossier.diagnosis.selection.first_round
    made = [None if gain is None else Evidence(gain, LEFT_OUT, (LEFT_OUT,)) for gain in gains]
    return [dataclasses.replace(t, evidence=e) for t, e in zip(found, made, strict=True)]


def test_the_nearest_gain_nearly_as_much_as_the_best() -> None:
    best, near, far, unfitted = tried(200.0, 200.0 * NEARLY, 199.0 * NEARLY, None)
    assert nearest([far, best, unfitted, near]) == (best, near)


@pytest.mark.parametrize("gains", [(), (None,), (-3.0, -2.0)])
def test_none_is_near_where_nothing_gains(gains: tuple[float | None, ...]) -> None:
    assert nearest(tried(*gains) if gains else []) == ()


def test_rivals_are_close_or_gain_nearly_as_much_and_are_not_accepted() -> None:
    first, close, far, unfitted = tried(1000.0, 1000.0, 500.0, None)
    assert is_close(close, first) and not is_close(far, first)
    found = rivals([first, close, far, unfitted], [first])
    assert [one.layer.id for one in found] == [close.layer.id]
    assert rivals([first, close], [first, close]) == ()


def test_a_candidate_beyond_the_score_is_a_rival_where_it_gains_nearly_as_much() -> None:
    """0.95 of 1000 nats is 50 nats less: told apart by the score, and may be it as well."""
    first, other = tried(1000.0, 950.0)
    assert first.score - other.score > CLOSE
    assert rivals([first, other], [first]) == (other,)


def test_nothing_rivals_where_nothing_is_accepted() -> None:
    first, other = tried(1000.0, 950.0)
    assert rivals([first, other], []) == ()
    assert rivals([first, other], [dataclasses.replace(first, evidence=None)]) == ()
