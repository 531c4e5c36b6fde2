"""Candidate search: which candidates are fitted, and in which order they are returned."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest

from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.model.candidate import Candidate
from diagnosis.model.placed_effect import PlacedEffect, shipped_effects
from diagnosis.selection import candidate_search
from diagnosis.selection.candidate_search import (
    MAX_FITS_BESIDE,
    MIN_SCREENING_GAIN,
    CandidateFit,
    search_candidates,
)
from tests.diagnosis.selection.fake_fits import candidate_of, fit_of, places_of, rotor_model_set

COST = 1000.0
"""The cost [nats] of the base."""
FULL = 10.0
"""Nats that a fit gains beyond its screening."""


class Search:
    """A search with given screening gains [nats]; None for a model that cannot be combined."""

    def __init__(
        self, monkeypatch: pytest.MonkeyPatch, gains: Sequence[float | None], accepted: int = 0
    ) -> None:
        self.model_set = rotor_model_set()
        places = places_of(self.model_set, shipped_effects(), len(gains) + accepted)
        self.base = fit_of(places[:accepted], COST)
        self.places = places[accepted:]
        self.gains = dict(zip([one.id for one in self.places], gains, strict=True))
        self.fitted: list[str] = []
        self.lines: list[str] = []
        monkeypatch.setattr(ModelSet, "try_compile_all", self._compile)
        monkeypatch.setattr(candidate_search, "screen_candidate", self._screen)
        monkeypatch.setattr(candidate_search, "with_best_gain_scale", lambda one, _: one)
        monkeypatch.setattr(candidate_search, "_fit_fully", self._fit)

    def run(self, more: Sequence[PlacedEffect] = ()) -> list[CandidateFit]:
        places = [*self.places, *more]
        point = self.base.point
        return search_candidates(self.model_set, self.base, places, point, self.lines.append)

    def _compile(self, combinations: Sequence[Sequence[PlacedEffect]]) -> list[Candidate | None]:
        known = [one for one in combinations if self.gains[one[-1].id] is not None]
        return [candidate_of(one) if one in known else None for one in combinations]

    def _screen(self, _: ModelSet, base: Estimate, candidate: Candidate) -> Estimate:
        gain = self.gains[candidate.placed_effects[-1].id]
        assert gain is not None
        return fit_of(candidate.placed_effects, base.cost - gain)

    def _fit(self, _: ModelSet, __: Estimate, screened: Estimate, ___: object) -> Estimate:
        effects = screened.candidate.placed_effects
        self.fitted.append(effects[-1].id)
        cost = math.inf if screened.cost < COST - 900.0 else screened.cost - FULL
        return fit_of(effects, cost)


def test_a_candidate_that_gains_nothing_is_not_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    low, least = MIN_SCREENING_GAIN - 0.1, MIN_SCREENING_GAIN
    search = Search(monkeypatch, [low, least, -5.0, 50.0, -math.inf])
    found = search.run()
    ids = [one.id for one in search.places]
    assert search.fitted == [ids[3], ids[1]]
    assert [one.placed_effect.id for one in found] == [ids[k] for k in (3, 1, 0, 2, 4)]
    assert [one.is_fitted for one in found] == [True, True, False, False, False]
    assert [one.cost for one in found[:3]] == [COST - 50.0 - FULL, COST - least - FULL, math.inf]
    assert found[0].screening_gain == 50.0
    assert search.lines == [f"{ids[3]}: 60 nats", f"{ids[1]}: 12 nats"]


def test_candidates_are_ordered_by_the_cost_of_their_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    search = Search(monkeypatch, [3.0, 90.0, 40.0])
    costs = [one.cost for one in search.run()]
    assert costs == sorted(costs) == [COST - gain - FULL for gain in (90.0, 40.0, 3.0)]


def test_beside_accepted_effects_only_the_first_are_fitted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    gains = [10.0 + k for k in range(MAX_FITS_BESIDE + 3)]
    search = Search(monkeypatch, gains, accepted=1)
    found = search.run()
    best = [one.id for one in reversed(search.places)]
    assert search.fitted == best[:MAX_FITS_BESIDE]
    assert [one.placed_effect.id for one in found] == best
    assert [one.is_fitted for one in found] == [True] * MAX_FITS_BESIDE + [False] * 3


def test_beside_the_base_alone_all_are_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    search = Search(monkeypatch, [10.0 + k for k in range(MAX_FITS_BESIDE + 3)])
    assert all(one.is_fitted for one in search.run())


def test_effects_of_the_base_and_impossible_ones_are_left_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    search = Search(monkeypatch, [5.0, None], accepted=1)
    (one,) = search.run(search.base.candidate.placed_effects)
    assert one.placed_effect.id == search.places[0].id
    present = search.base.candidate.placed_effects
    assert one.estimate is not None
    assert one.estimate.candidate.placed_effects == (*present, search.places[0])


def test_a_candidate_whose_fit_diverges_counts_as_not_fitted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    search = Search(monkeypatch, [950.0, 5.0])
    found = search.run()
    assert [one.screening_gain for one in found] == [5.0, 950.0]
    assert [one.is_fitted for one in found] == [True, False]
