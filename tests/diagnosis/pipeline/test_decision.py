"""Decision: the outcome follows from what is accepted, its rivals and what the base leaves."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import pytest

from diagnosis.criterion.explained_share import MAX_ORDINARY_ENERGY
from diagnosis.model.placed_effect import PlacedEffect, shipped_effects
from diagnosis.pipeline.decision import _outcome_of
from diagnosis.selection.forward_selection import Selection
from tests.diagnosis.selection.fake_fits import fit_of, places_of, rotor_model_set, round_of, tried

MODEL_SET = rotor_model_set()
LOUD = 1e6
"""Gain [nats] beside which noise does not count."""


@pytest.fixture
def places() -> list[PlacedEffect]:
    return places_of(MODEL_SET, shipped_effects(), 3)


def selection_of(
    places: Sequence[PlacedEffect],
    shares: Sequence[float],
    accepted: int = 1,
    energy: float = 10.0,
) -> Selection:
    """A selection of the first candidates, with all others as rivals of the first one."""
    base = fit_of((), 9000.0, [11.0])
    pairs = zip(places, shares, strict=False)
    candidates = tuple(tried(base, one, 100.0, share) for one, share in pairs)
    compared = round_of(base, candidates, energy, LOUD)
    model = candidates[0].estimate if accepted else base
    assert model is not None
    rivals = candidates[1:] if accepted else ()
    return Selection(base, model, candidates[:accepted], compared, compared, rivals)


@pytest.mark.parametrize(
    ("energy", "outcome"),
    [(MAX_ORDINARY_ENERGY, "nothing_missing"), (1.01 * MAX_ORDINARY_ENERGY, "unknown")],
)
def test_without_an_effect_it_matters_what_the_base_leaves(
    places: list[PlacedEffect], energy: float, outcome: str
) -> None:
    assert _outcome_of(selection_of(places, (0.1,), 0, energy), MODEL_SET) == outcome


@pytest.mark.parametrize(
    ("share", "outcome"), [(0.95, "ambiguous"), (0.945, "ambiguous"), (0.93, "effect")]
)
def test_a_rival_that_is_half_as_probable_makes_it_ambiguous(
    places: list[PlacedEffect], share: float, outcome: str
) -> None:
    assert _outcome_of(selection_of(places, (0.95, share)), MODEL_SET) == outcome


def test_a_rival_of_the_same_name_is_none(places: list[PlacedEffect]) -> None:
    alike = dataclasses.replace(places[0], suffix=f"{places[0].suffix}_2")
    assert _outcome_of(selection_of([places[0], alike], (0.95, 0.95)), MODEL_SET) == "effect"


def test_beside_a_second_effect_rivals_do_not_count(places: list[PlacedEffect]) -> None:
    assert _outcome_of(selection_of(places, (0.95, 0.95), 2), MODEL_SET) == "effect"


def test_an_accepted_effect_that_was_no_candidate_has_no_rival(places: list[PlacedEffect]) -> None:
    """An unknown input is found as a disturbance."""
    found = selection_of(places, (0.3, 0.2))
    hidden = dataclasses.replace(found.accepted[0], placed_effect=places[2])
    found = dataclasses.replace(found, accepted=(hidden,), rivals=())
    assert _outcome_of(found, MODEL_SET) == "effect"
