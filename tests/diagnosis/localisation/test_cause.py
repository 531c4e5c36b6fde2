"""What acts where something is missing is told by what it does over time: a body, an input."""

from __future__ import annotations

import dataclasses
from unittest.mock import patch

import pytest

from diagnosis.estimation.model_set import ModelSet
from diagnosis.localisation.cause import attribute_causes, is_inactive
from diagnosis.localisation.disturbance_state_fit import free_disturbance
from diagnosis.localisation.location import Location, location_of, with_smoothed_disturbances
from diagnosis.localisation.ranking import rank_causes_first
from tests.diagnosis.estimation import test_levenberg_marquardt
from tests.diagnosis.estimation.test_levenberg_marquardt import FRICTION, bench
from tests.diagnosis.localisation.test_ranking import fit_first_base, with_effect

__all__ = ["bench"]


def missing(
    bench: ModelSet, effect: str, own: dict[str, float], drift: int
) -> tuple[ModelSet, Location]:
    """Return recordings of 10 s with an effect, and what the base lacks in a balance, over time."""
    with patch.object(test_levenberg_marquardt, "COUNT", 2000):
        hidden = with_effect(bench, effect, own)
    base, layer = fit_first_base(hidden), hidden.disturbances[drift]
    free = free_disturbance(hidden, base, layer)
    return hidden, with_smoothed_disturbances(hidden, location_of(hidden, "flow", layer, free))


@pytest.mark.parametrize(
    ("effect", "own", "drift", "acts"),
    [
        (
            "compliance@vehicle",
            {"part_vehicle": 0.03, "k_c_vehicle": 10000.0, "c_c_vehicle": 60.0},
            1,
            ["elements.vehicle"],
        ),
        ("torque_offset@T_em", {"offset_T_em": 4.0}, 0, ["inputs.T_em"]),
        ("coulomb_friction@w_em", FRICTION, 0, []),
        ("road_grade@w_w", {"grade_w_w": 0.05}, 1, []),
    ],
)
def test_a_drift_tells_what_acts_in_its_balance(
    bench: ModelSet, effect: str, own: dict[str, float], drift: int, acts: list[str]
) -> None:
    assert list(attribute_causes(*missing(bench, effect, own, drift))) == acts


def test_a_drift_that_is_not_known_over_time_tells_nothing_but_ripples(bench: ModelSet) -> None:
    assert not list(attribute_causes(bench, Location("flow", "w_w", 90.0, 2.0)))
    along = (("order 2 of the angle of w_em", 0.8),)
    assert list(attribute_causes(bench, Location("flow", "w_em", 90.0, 2.0, correlates=along))) == [
        "inputs.T_em"
    ]


def test_what_is_missing_while_an_input_rests_is_not_that_inputs(bench: ModelSet) -> None:
    hidden, locus = missing(bench, "road_grade@w_w", {"grade_w_w": 0.05}, 1)
    resting = [dataclasses.replace(one, inputs=one.inputs.copy()) for one in hidden.series]
    for one in resting:
        one.inputs[:, 1] = 0.0
        one.inputs[-5:, 1] = 100.0
    still = dataclasses.replace(hidden, series=tuple(resting))
    assert is_inactive(still, locus, "inputs.T_br")
    assert not is_inactive(still, locus, "flow.w_w")
    assert rank_causes_first((locus,), ["inputs.T_br"], still)[0].path == "flow.w_w"
    for one in resting:
        one.inputs[:, 1] = 100.0
    assert not is_inactive(still, locus, "inputs.T_br")
    assert rank_causes_first((locus,), ["inputs.T_br"], still)[0].path == "inputs.T_br"
