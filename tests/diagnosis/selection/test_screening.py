"""Screening: a few steps of a candidate from its starts show most of what a fit gains."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.levenberg_marquardt import estimate_parameters
from diagnosis.estimation.model_set import ModelSet
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter import FreeParameter
from diagnosis.selection.screening import screen_candidate, start_values
from tests.diagnosis.estimation.test_levenberg_marquardt import (
    FRICTION,
    TRUTH,
    bench,
    place_effect,
    simulate_recordings,
)
from tests.diagnosis.localisation.test_ranking import fit_first_base

__all__ = ["bench"]
COUNT = 6
"""Recordings, one of which shows the drag of a brake."""


@pytest.fixture(scope="module")
def rubbing(bench: ModelSet) -> tuple[ModelSet, Estimate]:
    """Recordings of a driveline with dry friction of the motor, and the base fitted to them."""
    friction = bench.compile_candidate((place_effect(bench, "coulomb_friction@w_em"),))
    series = simulate_recordings(friction, {**TRUTH, **FRICTION})
    model_set = dataclasses.replace(bench, series=series)
    return model_set, fit_first_base(model_set)


def test_a_few_steps_show_most_of_what_a_fit_gains(rubbing: tuple[ModelSet, Estimate]) -> None:
    model_set, base = rubbing
    candidate = model_set.compile_candidate((place_effect(model_set, "coulomb_friction@w_em"),))
    screened = screen_candidate(model_set, base, candidate)
    fitted = estimate_parameters(
        candidate, model_set.series, base.noise_levels, {**base.values(0), **FRICTION}
    )
    assert fitted.cost <= screened.cost + 1.0
    assert base.cost - screened.cost > 0.8 * (base.cost - fitted.cost) > 100.0
    assert screened.values(0)["T_c_w_em"] == pytest.approx(FRICTION["T_c_w_em"], rel=0.2)
    assert screened.noise_levels == base.noise_levels


def test_an_effect_that_does_not_act_gains_little(rubbing: tuple[ModelSet, Estimate]) -> None:
    model_set, base = rubbing
    gains = []
    for name in ("coulomb_friction@w_em", "sensor_lag@w_em"):
        candidate = model_set.compile_candidate((place_effect(model_set, name),))
        gains.append(base.cost - screen_candidate(model_set, base, candidate).cost)
    assert gains[1] < 0.25 * gains[0]


def test_an_effect_that_a_single_recording_shows_is_found(bench: ModelSet) -> None:
    drag = bench.compile_candidate((place_effect(bench, "brake_drag@w_w"),))
    known = {**TRUTH, "T_r_w_w": 150.0}
    free, held = simulate_recordings(drag, known), simulate_recordings(drag, known, brake=300.0)
    series = tuple(
        dataclasses.replace((held if k == 1 else free)[k % 2], name=f"{k}") for k in range(COUNT)
    )
    own = dataclasses.replace(bench, series=series)
    base = fit_first_base(own)
    assert base.cost - screen_candidate(own, base, drag).cost > 20.0


def test_a_candidate_that_diverges_has_an_infinite_cost(
    rubbing: tuple[ModelSet, Estimate],
) -> None:
    model_set, base = rubbing
    candidate = model_set.compile_candidate((place_effect(model_set, "coulomb_friction@w_em"),))
    huge = tuple(dataclasses.replace(one, inputs=one.inputs + np.inf) for one in model_set.series)
    lost = dataclasses.replace(model_set, series=huge)
    assert screen_candidate(lost, base, candidate).cost == np.inf


def candidate_with(*parameters: FreeParameter) -> Candidate:
    """A candidate of which only the free parameters are known."""
    return cast(Candidate, cast(Any, SimpleNamespace(free_parameters=parameters)))


def test_there_are_as_many_starts_as_the_longest_list_has() -> None:
    free = FreeParameter("own", 1.0, 0.1, 9.0, 1.0, False, starts=(1.0, 2.0, 3.0))
    short = dataclasses.replace(free, name="short", starts=(4.0, 5.0))
    phase = dataclasses.replace(free, name="phase", per_recording=True, starts=(0.0, 1.0, 2.0, 3.0))
    known = dataclasses.replace(free, name="known", starts=(7.0, 8.0, 9.0, 10.0))
    candidate = candidate_with(free, known, short, phase)
    assert start_values(candidate, {"known": 7.5}) == [
        {"own": 1.0, "short": 4.0, "phase": 0.0},
        {"own": 2.0, "short": 5.0, "phase": 1.0},
        {"own": 3.0, "short": 5.0, "phase": 2.0},
    ]


def test_without_parameters_of_its_own_a_candidate_has_one_start() -> None:
    known = FreeParameter("known", 1.0, 0.1, 9.0, 1.0, False, starts=(1.0, 2.0))
    assert start_values(candidate_with(known), {"known": 7.5}) == [{}]
