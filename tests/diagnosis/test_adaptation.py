"""What each recording has of its own is found wherever a model was fitted before."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.adaptation import adapted, turned
from diagnosis.bench import Bench
from diagnosis.estimate import looked_at
from diagnosis.layers import fitting, shipped_effects
from diagnosis.point import point_of
from diagnosis.prediction import noises_of
from tests.diagnosis.test_estimation import TRUTH, bench, recorded

__all__ = ["bench"]
PHASE = -2.3


@pytest.mark.parametrize("before", [0.8, 2.4, -5.0])
def test_a_phase_is_found_far_from_that_of_other_recordings(bench: Bench, before: float) -> None:
    effect = next(one for one in shipped_effects() if one.name == "sensor_eccentricity")
    layer = next(one for one in fitting(bench.document, effect) if one.place == "w_s")
    candidate = bench.candidate((layer,))
    known = {**TRUTH, "ecc_w_s": 0.02}
    held = recorded(candidate, {**known, "ph_w_s": PHASE})
    point = point_of(candidate, len(held), {**known, "ph_w_s": before})
    model = looked_at(candidate, held, noises_of(held, {}), point)
    found = adapted(model, held)
    for k in range(len(held)):
        apart = np.remainder(found.values(k)["ph_w_s"] - PHASE + np.pi, 2.0 * np.pi) - np.pi
        assert abs(apart) < 0.15
        assert found.values(k)["ecc_w_s"] == model.values(k)["ecc_w_s"]


def test_a_phase_that_is_right_is_not_turned_to_a_start(bench: Bench) -> None:
    effect = next(one for one in shipped_effects() if one.name == "sensor_eccentricity")
    layer = next(one for one in fitting(bench.document, effect) if one.place == "w_s")
    candidate = bench.candidate((layer,))
    known = {**TRUTH, "ecc_w_s": 0.02, "ph_w_s": PHASE}
    held = recorded(candidate, known)
    model = looked_at(candidate, held, noises_of(held, {}), point_of(candidate, len(held), known))
    assert turned(model, held).values(0)["ph_w_s"] == pytest.approx(PHASE)
