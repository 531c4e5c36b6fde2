"""Which candidates are fitted, and when a further effect is not taken."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from diagnosis.alone import PROMISED
from diagnosis.bench import Bench
from diagnosis.evidence import Evidence
from diagnosis.screening import Promise
from diagnosis.search import FULL_FITS, Tried, searched
from diagnosis.selection import HOPE, MOST_EFFECTS, selected
from diagnosis.threshold import USUAL
from tests.diagnosis.test_adequacy import accepting, rubbing
from tests.diagnosis.test_estimation import bench
from tests.diagnosis.test_location import based
from tests.diagnosis.test_needed import DRAG, FRICTION, layer

__all__ = ["bench", "rubbing"]
THIRD = "torque_offset@T_em"
WORTH = 5
"""Place of what a candidate has to promise among what a search is given."""


def test_what_some_recordings_alone_promise_takes_no_turn_of_a_fit(
    bench: Bench, rubbing: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Candidates that were not looked at on all recordings promise most; none can be fitted."""
    friction = accepting(bench, rubbing, FRICTION)
    unseen = [Promise(layer(bench, DRAG), 1e6)] * FULL_FITS
    seen = Promise(layer(bench, FRICTION), 1e3, friction.model)
    monkeypatch.setattr("diagnosis.search.promises", lambda *_: [*unseen, seen])
    found = searched(rubbing, friction.base, {}, [])
    assert [one.layer.id for one in found if one.evidence] == [FRICTION]
    assert len(found) == FULL_FITS + 1


@pytest.mark.parametrize("strained", [2, MOST_EFFECTS, MOST_EFFECTS + 1])
def test_a_last_effect_that_pulls_the_others_out_of_their_ranges_is_not_taken(
    bench: Bench, rubbing: Bench, monkeypatch: pytest.MonkeyPatch, strained: int
) -> None:
    """So many effects are strained together; what was strained before it is left to the verdict."""
    model = accepting(bench, rubbing, FRICTION).model
    gains = iter(Evidence(gain, gain, (gain / 9.0,) * 9) for gain in (9000.0, 900.0, 300.0))
    names = iter((FRICTION, DRAG, THIRD))

    def found(*_: object) -> list[Tried]:
        return [Tried(layer(bench, next(names)), 9000.0, model, next(gains))]

    def many(_: object, accepted: Sequence[Tried]) -> bool:
        return len(accepted) >= strained

    monkeypatch.setattr("diagnosis.selection.searched", found)
    monkeypatch.setattr(
        "diagnosis.selection.looked_again", lambda _, m, u, tried, *__: (None, tried)
    )
    monkeypatch.setattr("diagnosis.selection.shown_form", lambda _, m, u, best, tried: best)
    monkeypatch.setattr("diagnosis.selection.swapped", lambda _, m, before, *__: (before, m))
    monkeypatch.setattr("diagnosis.selection.is_full", lambda *_: False)
    monkeypatch.setattr("diagnosis.selection.still_needed", lambda _, kept, *__: kept)
    monkeypatch.setattr("diagnosis.selection.is_strained", many)
    accepted = selected(rubbing, based(rubbing), {}).accepted
    assert len(accepted) == (MOST_EFFECTS - 1 if strained == MOST_EFFECTS else MOST_EFFECTS)


@pytest.mark.parametrize(("hope", "least"), [(HOPE, 0.25 * USUAL), (PROMISED, 0.1 * USUAL)])
def test_a_candidate_has_to_promise_a_part_of_what_it_must_gain(
    rubbing: Bench, monkeypatch: pytest.MonkeyPatch, hope: float, least: float
) -> None:
    """A quarter, but where whole simulations are judged: a tenth (decision 0040)."""
    asked: list[object] = []

    def found(*given: object) -> list[Tried]:
        asked.append(given[WORTH])
        return []

    monkeypatch.setattr("diagnosis.selection.searched", found)
    selection = selected(rubbing, based(rubbing), {}, hope=hope)
    assert not selection.accepted
    assert asked == [pytest.approx(least)]
