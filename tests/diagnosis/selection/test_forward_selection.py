"""Which candidates are fitted, and when a further effect is not taken."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from diagnosis.criterion.likelihood_gain import LikelihoodGain
from tests.diagnosis.selection.test_backward_elimination import DRAG, FRICTION, find_layer
from tests.diagnosis.validation.test_adequacy import rubbing, select_effect

from diagnosis.criterion.threshold import DEFAULT_THRESHOLD
from diagnosis.estimation.model_set import ModelSet
from diagnosis.selection.candidate_search import MAX_FITS, CandidateFit, search_candidates
from diagnosis.selection.forward_selection import MAX_EFFECTS, SCREENING_FRACTION, select_effects
from diagnosis.selection.output_error import OUTPUT_ERROR_SCREENING_FRACTION
from diagnosis.selection.screening import ScreeningResult
from tests.diagnosis.estimation.test_levenberg_marquardt import bench
from tests.diagnosis.localisation.test_ranking import fit_first_base

__all__ = ["bench", "rubbing"]
THIRD = "torque_offset@T_em"
WORTH = 5
"""Place of what a candidate has to promise among what a search is given."""


def test_what_some_recordings_alone_promise_takes_no_turn_of_a_fit(
    bench: ModelSet, rubbing: ModelSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Candidates that were not looked at on all recordings promise most; none can be fitted."""
    friction = select_effect(bench, rubbing, FRICTION)
    unseen = [ScreeningResult(find_layer(bench, DRAG), 1e6)] * MAX_FITS
    seen = ScreeningResult(find_layer(bench, FRICTION), 1e3, friction.model)
    monkeypatch.setattr(
        "diagnosis.selection.candidate_search.screen_candidates", lambda *_: [*unseen, seen]
    )
    found = search_candidates(rubbing, friction.base, {}, [])
    assert [one.placed_effect.id for one in found if one.likelihood_gain] == [FRICTION]
    assert len(found) == MAX_FITS + 1


@pytest.mark.parametrize("strained", [2, MAX_EFFECTS, MAX_EFFECTS + 1])
def test_a_last_effect_that_pulls_the_others_out_of_their_ranges_is_not_taken(
    bench: ModelSet, rubbing: ModelSet, monkeypatch: pytest.MonkeyPatch, strained: int
) -> None:
    """So many effects are strained together; what was strained before it is left to the verdict."""
    model = select_effect(bench, rubbing, FRICTION).model
    gains = iter(LikelihoodGain(gain, gain, (gain / 9.0,) * 9) for gain in (9000.0, 900.0, 300.0))
    names = iter((FRICTION, DRAG, THIRD))

    def found(*_: object) -> list[CandidateFit]:
        return [CandidateFit(find_layer(bench, next(names)), 9000.0, model, next(gains))]

    def many(_: object, accepted: Sequence[CandidateFit]) -> bool:
        return len(accepted) >= strained

    monkeypatch.setattr("diagnosis.selection.forward_selection.search_candidates", found)
    monkeypatch.setattr(
        "diagnosis.selection.forward_selection.rescreen_after_refit",
        lambda _, m, u, tried, *__: (None, tried),
    )
    monkeypatch.setattr(
        "diagnosis.selection.forward_selection.choose_form", lambda _, m, u, best, tried: best
    )
    monkeypatch.setattr(
        "diagnosis.selection.forward_selection.exchange_effects",
        lambda _, m, before, *__: (before, m),
    )
    monkeypatch.setattr(
        "diagnosis.selection.forward_selection.meets_stopping_rule", lambda *_: False
    )
    monkeypatch.setattr(
        "diagnosis.selection.forward_selection.eliminate_backward", lambda _, kept, *__: kept
    )
    monkeypatch.setattr("diagnosis.selection.forward_selection.rejects_bounds", many)
    accepted = select_effects(rubbing, fit_first_base(rubbing), {}).accepted
    assert len(accepted) == (MAX_EFFECTS - 1 if strained == MAX_EFFECTS else MAX_EFFECTS)


@pytest.mark.parametrize(
    ("hope", "least"),
    [
        (SCREENING_FRACTION, 0.25 * DEFAULT_THRESHOLD),
        (OUTPUT_ERROR_SCREENING_FRACTION, 0.1 * DEFAULT_THRESHOLD),
    ],
)
def test_a_candidate_has_to_promise_a_part_of_what_it_must_gain(
    rubbing: ModelSet, monkeypatch: pytest.MonkeyPatch, hope: float, least: float
) -> None:
    """A quarter, but where whole simulations are judged: a tenth (decision 0040)."""
    asked: list[object] = []

    def found(*given: object) -> list[CandidateFit]:
        asked.append(given[WORTH])
        return []

    monkeypatch.setattr("diagnosis.selection.forward_selection.search_candidates", found)
    selection = select_effects(rubbing, fit_first_base(rubbing), {}, screening_fraction=hope)
    assert not selection.accepted
    assert asked == [pytest.approx(least)]
