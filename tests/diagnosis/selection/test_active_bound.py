"""What acts in one balance alone and stands at the end of its range tells what is missing there."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.model.parameter_vector import ParameterVector, bounds_of, vector_of
from diagnosis.pipeline.decision import _rejection_reason
from diagnosis.selection.active_bound import (
    active_bound_locations,
    has_opposing_active_bound,
    release_active_bounds,
)
from diagnosis.selection.candidate_search import ENTRY_THRESHOLD, MAX_RELEASED_FITS, _FitBudget
from diagnosis.selection.screening import ScreeningResult
from tests.diagnosis.estimation.test_levenberg_marquardt import bench
from tests.diagnosis.selection.test_backward_elimination import FRICTION, find_layer
from tests.diagnosis.validation.test_adequacy import rubbing, select_effect

__all__ = ["bench", "rubbing"]
SAMPLES = 40


def pressing(model: Estimate, ends: dict[str, int]) -> Estimate:
    """Return a model with some parameters at an end of their ranges (0 or 1)."""
    shared = np.zeros(len(model.candidate.names))
    for name, end in ends.items():
        k = model.candidate.names.index(name)
        shared[k] = bounds_of(model.candidate)[k, end]
    own = np.tile(shared, (len(model.point.per_recording), 1))
    return dataclasses.replace(model, point=ParameterVector(shared, own))


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
    bench: ModelSet, rubbing: ModelSet, ends: dict[str, int], places: set[str]
) -> None:
    model = pressing(select_effect(bench, rubbing, FRICTION).model, ends)
    assert active_bound_locations(model, bench.automaton) == places


def test_what_is_pressed_is_eased_and_nothing_else(bench: ModelSet, rubbing: ModelSet) -> None:
    model = pressing(select_effect(bench, rubbing, FRICTION).model, {"b_em": 1, "k": 1})
    point, names = release_active_bounds(model, bench.automaton), model.candidate.names
    declared = vector_of(model.candidate, len(model.point.per_recording), {})
    for k, name in enumerate(names):
        wanted = declared if name == "b_em" else model.point
        assert point.shared[k] == wanted.shared[k]
        assert np.array_equal(point.per_recording[:, k], wanted.per_recording[:, k])
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
    bench: ModelSet, rubbing: ModelSet, name: str, end: int, sign: float, is_imitation: bool
) -> None:
    selection = select_effect(bench, rubbing, FRICTION)
    adds = np.ones((SAMPLES, 2))
    columns = {one: np.zeros((SAMPLES, 2)) for one in selection.model.candidate.names}
    columns |= {"T_c_w_em": adds, name: sign * adds}
    model = dataclasses.replace(pressing(selection.model, {name: end}), jacobian=columns)
    friction = find_layer(bench, FRICTION)
    assert has_opposing_active_bound(model, friction, bench.automaton) is is_imitation
    assert not has_opposing_active_bound(
        model, find_layer(bench, "sensor_lag@w_s"), bench.automaton
    )
    judged = dataclasses.replace(selection, model=model)
    assert ("its balance" in _rejection_reason(judged, rubbing)) is is_imitation


@pytest.mark.parametrize(
    ("ends", "gain", "is_fitted"),
    [({"b_em": 1}, 5.0, True), ({"b_em": 1}, -5.0, False), ({"b_w": 1}, 5.0, False)],
)
def test_what_promises_little_where_the_base_is_pressed_is_fitted_all_the_same(
    bench: ModelSet, rubbing: ModelSet, ends: dict[str, int], gain: float, is_fitted: bool
) -> None:
    """Beside what was accepted, for a few candidates; alone all that promise much are."""
    model = pressing(select_effect(bench, rubbing, FRICTION).model, ends)
    promise = ScreeningResult(find_layer(bench, "quadratic_drag@w_em"), gain)
    chances = _FitBudget(rubbing, model, ENTRY_THRESHOLD)
    starts = [chances.start(promise, []) for _ in range(MAX_RELEASED_FITS + 1)]
    assert [start is not None for start in starts] == [is_fitted] * MAX_RELEASED_FITS + [False]
    if starts[0] is not None:
        k = starts[0].candidate.names.index("b_em")
        assert starts[0].point.shared[k] == vector_of(starts[0].candidate, 1, {}).shared[k]
    alone = pressing(model, ends)
    bare = rubbing.compile_candidate(())
    base = dataclasses.replace(
        alone, candidate=bare, point=vector_of(bare, len(rubbing.series), {})
    )
    assert _FitBudget(rubbing, base, ENTRY_THRESHOLD).start(promise, []) is None
