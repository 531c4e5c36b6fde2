"""What acts in one balance alone and stands at the end of its range tells what is missing there."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from diagnosis.bench import Bench
from diagnosis.estimate import Estimate
from diagnosis.judgement import _why_not
from diagnosis.point import Point, bounds_of, point_of
from diagnosis.pressed import eased, is_opposed, pressed_places
from diagnosis.screening import Promise
from diagnosis.search import FITS_EASED, WORTH, _Chances
from tests.diagnosis.test_adequacy import accepting, rubbing
from tests.diagnosis.test_estimation import bench
from tests.diagnosis.test_needed import FRICTION, layer

__all__ = ["bench", "rubbing"]
SAMPLES = 40


def pressing(model: Estimate, ends: dict[str, int]) -> Estimate:
    """Return a model with some parameters at an end of their ranges (0 or 1)."""
    shared = np.zeros(len(model.candidate.names))
    for name, end in ends.items():
        k = model.candidate.names.index(name)
        shared[k] = bounds_of(model.candidate)[k, end]
    own = np.tile(shared, (len(model.point.own), 1))
    return dataclasses.replace(model, point=Point(shared, own))


@pytest.mark.parametrize(
    ("ends", "places"),
    [
        ({"b_em": 1}, {"w_em", "T_em"}),
        ({"cd2": 0}, {"w_w", "T_br"}),
        ({"b_em": 0, "f0": 1}, {"w_em", "T_em", "w_w", "T_br"}),
        ({"k": 1, "alpha": 0}, set()),  # a shaft acts in both balances
        ({"T_c_w_em": 1}, set()),  # an effect's own
        ({}, set()),
    ],
)
def test_a_balance_is_pressed_where_what_acts_there_alone_is_at_an_end(
    bench: Bench, rubbing: Bench, ends: dict[str, int], places: set[str]
) -> None:
    model = pressing(accepting(bench, rubbing, FRICTION).model, ends)
    assert pressed_places(model, bench.automaton) == places


def test_what_is_pressed_is_eased_and_nothing_else(bench: Bench, rubbing: Bench) -> None:
    model = pressing(accepting(bench, rubbing, FRICTION).model, {"b_em": 1, "k": 1})
    point, names = eased(model, bench.automaton), model.candidate.names
    declared = point_of(model.candidate, len(model.point.own), {})
    for k, name in enumerate(names):
        wanted = declared if name == "b_em" else model.point
        assert point.shared[k] == wanted.shared[k]
        assert np.array_equal(point.own[:, k], wanted.own[:, k])
    assert model.point.shared[names.index("b_em")] != declared.shared[names.index("b_em")]


@pytest.mark.parametrize(
    ("name", "end", "sign", "is_imitation"),
    [
        ("b_em", 0, 1.0, True),  # less friction than there may be: one that falls with the speed
        ("b_em", 1, 1.0, False),
        ("b_em", 1, -1.0, True),
        ("b_em", 0, -1.0, False),
        ("b_em", 0, 0.0, False),
        ("b_w", 0, 1.0, False),  # in another balance
    ],
)
def test_what_gives_up_more_for_an_effect_than_it_can_shows_an_imitation(
    bench: Bench, rubbing: Bench, name: str, end: int, sign: float, is_imitation: bool
) -> None:
    selection = accepting(bench, rubbing, FRICTION)
    adds = np.ones((SAMPLES, 2))
    columns = {one: np.zeros((SAMPLES, 2)) for one in selection.model.candidate.names}
    columns |= {"T_c_w_em": adds, name: sign * adds}
    model = dataclasses.replace(pressing(selection.model, {name: end}), columns=columns)
    friction = layer(bench, FRICTION)
    assert is_opposed(model, friction, bench.automaton) is is_imitation
    assert not is_opposed(model, layer(bench, "sensor_lag@w_s"), bench.automaton)
    judged = dataclasses.replace(selection, model=model)
    assert ("its balance" in _why_not(judged, rubbing)) is is_imitation


@pytest.mark.parametrize(
    ("ends", "gain", "is_fitted"),
    [({"b_em": 1}, 5.0, True), ({"b_em": 1}, -5.0, False), ({"b_w": 1}, 5.0, False)],
)
def test_what_promises_little_where_the_base_is_pressed_is_fitted_all_the_same(
    bench: Bench, rubbing: Bench, ends: dict[str, int], gain: float, is_fitted: bool
) -> None:
    """Beside what was accepted, for a few candidates; alone all that promise much are."""
    model = pressing(accepting(bench, rubbing, FRICTION).model, ends)
    promise = Promise(layer(bench, "quadratic_drag@w_em"), gain)
    chances = _Chances(rubbing, model, WORTH)
    starts = [chances.start(promise, []) for _ in range(FITS_EASED + 1)]
    assert [start is not None for start in starts] == [is_fitted] * FITS_EASED + [False]
    if starts[0] is not None:
        k = starts[0].candidate.names.index("b_em")
        assert starts[0].point.shared[k] == point_of(starts[0].candidate, 1, {}).shared[k]
    alone = pressing(model, ends)
    bare = rubbing.candidate(())
    base = dataclasses.replace(alone, candidate=bare, point=point_of(bare, len(rubbing.series), {}))
    assert _Chances(rubbing, base, WORTH).start(promise, []) is None
