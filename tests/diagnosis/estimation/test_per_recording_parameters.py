"""What each recording has of its own is found wherever a model was fitted before."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.estimation.estimate import evaluate
from diagnosis.estimation.innovations import measured_noise_levels
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.per_recording_parameters import reestimate_per_recording, restart_phases
from diagnosis.model.parameter_vector import vector_of
from diagnosis.model.placed_effect import find_placements, shipped_effects
from tests.diagnosis.estimation.test_levenberg_marquardt import TRUTH, bench, simulate_recordings

__all__ = ["bench"]
PHASE = -2.3


@pytest.mark.parametrize("before", [0.8, 2.4, -5.0])
def test_a_phase_is_found_far_from_that_of_other_recordings(bench: ModelSet, before: float) -> None:
    effect = next(one for one in shipped_effects() if one.name == "sensor_eccentricity")
    layer = next(one for one in find_placements(bench.document, effect) if one.place == "w_s")
    candidate = bench.compile_candidate((layer,))
    known = {**TRUTH, "ecc_w_s": 0.02}
    held = simulate_recordings(candidate, {**known, "ph_w_s": PHASE})
    point = vector_of(candidate, len(held), {**known, "ph_w_s": before})
    model = evaluate(candidate, held, measured_noise_levels(held, {}), point)
    found = reestimate_per_recording(model, held)
    for k in range(len(held)):
        apart = np.remainder(found.values(k)["ph_w_s"] - PHASE + np.pi, 2.0 * np.pi) - np.pi
        assert abs(apart) < 0.15
        assert found.values(k)["ecc_w_s"] == model.values(k)["ecc_w_s"]


def test_a_phase_that_is_right_is_not_turned_to_a_start(bench: ModelSet) -> None:
    effect = next(one for one in shipped_effects() if one.name == "sensor_eccentricity")
    layer = next(one for one in find_placements(bench.document, effect) if one.place == "w_s")
    candidate = bench.compile_candidate((layer,))
    known = {**TRUTH, "ecc_w_s": 0.02, "ph_w_s": PHASE}
    held = simulate_recordings(candidate, known)
    model = evaluate(
        candidate, held, measured_noise_levels(held, {}), vector_of(candidate, len(held), known)
    )
    assert restart_phases(model, held).values(0)["ph_w_s"] == pytest.approx(PHASE)
