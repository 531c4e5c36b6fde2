"""Slopes that are carried along a step show what it did; a tone is stepped finely."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from diagnosis.estimation.estimate import evaluate, predict_with_gains_of, with_normal_equations
from diagnosis.estimation.innovations import measured_noise_levels
from diagnosis.estimation.jacobian import broyden_update
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.normal_equations import predicted_gain
from diagnosis.model.parameter_vector import ParameterVector, vector_of
from diagnosis.model.placed_effect import (
    automaton_with_effects,
    find_placements,
    minimum_substeps,
    shipped_effects,
)
from tests.diagnosis.estimation.test_levenberg_marquardt import TRUTH, bench, simulate_recordings

__all__ = ["bench"]


def test_carried_slopes_show_what_a_step_did(bench: ModelSet) -> None:
    candidate = bench.compile_candidate(())
    series = simulate_recordings(candidate, TRUTH)
    here = evaluate(
        candidate, series, measured_noise_levels(series, {}), vector_of(candidate, len(series), {})
    )
    here = with_normal_equations(here, series)
    step = ParameterVector(
        np.full(len(candidate.names), 0.1), np.full((len(series), len(candidate.names)), 0.1)
    )
    there = ParameterVector(
        here.point.shared + step.shared, here.point.per_recording + step.per_recording
    )
    after = predict_with_gains_of(here, series, there)
    found = broyden_update(candidate, here.jacobian, here.prediction, after, step)
    moved = np.sum([0.1 * found[name] for name in candidate.names], axis=0)
    known = np.isfinite(after.stacked - here.prediction.stacked)
    assert np.allclose(moved[known], (after.stacked - here.prediction.stacked)[known], atol=1e-9)
    still = here.normal_equations
    assert still is not None
    assert predicted_gain(candidate, here.point, still, here.point) == pytest.approx(0.0)


@pytest.mark.parametrize(("period", "steps"), [(Fraction(1, 200), 5), (Fraction(1, 100), 10)])
def test_a_tone_at_an_input_is_stepped_by_a_millisecond(
    bench: ModelSet, period: Fraction, steps: int
) -> None:
    effect = next(one for one in shipped_effects() if one.name == "torque_ripple")
    layer = next(iter(find_placements(bench.document, effect)))
    made = automaton_with_effects(bench.document, bench.project, [layer])
    assert minimum_substeps(made, [layer], bench.output_names, period) == steps
    assert minimum_substeps(bench.automaton, [], bench.output_names, period) == 1


def test_a_drift_goes_with_a_delay_and_with_a_limited_rate(bench: ModelSet) -> None:
    known = {one.name: one for one in shipped_effects()}
    drift, *others = (
        next(one for one in find_placements(bench.document, known[name]) if one.place == "T_em")
        for name in ("torque_drift", "actuator_delay", "torque_rate_limit")
    )
    for other in others:
        assert automaton_with_effects(bench.document, bench.project, [drift, other]).parameters
