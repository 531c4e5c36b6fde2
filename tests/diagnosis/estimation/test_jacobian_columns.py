"""How innovations change with a coordinate, be it the order of a tone that runs for a long time."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.estimation.estimate import evaluate, innovations_at, predict_with_gains_of
from diagnosis.estimation.innovations import measured_noise_levels
from diagnosis.estimation.jacobian import STEP, difference_jacobian
from diagnosis.estimation.levenberg_marquardt import estimate_parameters
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.normal_equations import NormalEquations, damped_step
from diagnosis.model.parameter_vector import ParameterVector, vector_of
from tests.diagnosis.estimation.test_levenberg_marquardt import (
    TRUTH,
    bench,
    place_effect,
    simulate_recordings,
)

__all__ = ["bench"]
TONE = {"a_T_em": 6.0, "ord_T_em": 4.0, "ph_T_em": 0.5}


@pytest.mark.parametrize("name", ["ord_T_em", "a_T_em", "J_em"])
def test_a_column_is_the_slope_at_its_point(bench: ModelSet, name: str) -> None:
    candidate = bench.compile_candidate((place_effect(bench, "torque_ripple@T_em"),))
    series = simulate_recordings(candidate, {**TRUTH, **TONE})
    point = vector_of(candidate, len(series), {**TRUTH, **TONE})
    here = evaluate(candidate, series, measured_noise_levels(series, {}), point)
    found = difference_jacobian(
        candidate,
        point,
        here.prediction,
        lambda points: innovations_at(here, series, points),
        [name],
    )[name]
    tiny, k = 1e-6, candidate.names.index(name)
    ahead, behind = (
        predict_with_gains_of(here, series, point.perturb(candidate, k, s)) for s in (tiny, -tiny)
    )
    apart = (
        point.perturb(candidate, k, tiny).shared[k] - point.perturb(candidate, k, -tiny).shared[k]
    )
    slope = (ahead.stacked - behind.stacked) / apart
    assert np.nanmax(np.abs(found - slope)) < 0.25 * np.nanmax(np.abs(slope))
    assert tiny < STEP


def test_the_strength_of_a_tone_is_found_from_where_its_order_is_right(bench: ModelSet) -> None:
    candidate = bench.compile_candidate((place_effect(bench, "torque_ripple@T_em"),))
    series = simulate_recordings(candidate, {**TRUTH, **TONE})
    start = {**TRUTH, **TONE, "a_T_em": 1.0}
    found = estimate_parameters(candidate, series, measured_noise_levels(series, {}), start)
    assert found.values(0)["a_T_em"] == pytest.approx(TONE["a_T_em"], rel=0.1)


def test_a_step_is_found_where_changes_drown_the_priors(bench: ModelSet) -> None:
    candidate = bench.compile_candidate(())
    count = len(candidate.names)
    point = ParameterVector(np.zeros(count), np.zeros((1, count)))
    normal = NormalEquations(
        np.full((1, count, count), 1e180),
        np.full((1, count), 1e90),
        np.zeros(count, dtype=bool),
    )
    assert np.all(np.isfinite(damped_step(candidate, point, normal, 0.0).shared))
