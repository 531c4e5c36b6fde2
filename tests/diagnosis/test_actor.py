"""What acts where something is missing is told by what it does over time: a body, an input."""

from __future__ import annotations

import dataclasses

import pytest

from diagnosis.actor import actors, rests
from diagnosis.bench import Bench
from diagnosis.freedom import freed
from diagnosis.layers import shipped_effects
from diagnosis.location import likely
from diagnosis.locus import Locus, locus_of, over_time
from tests.diagnosis.test_estimation import FRICTION, bench
from tests.diagnosis.test_location import based, with_effect

__all__ = ["bench"]


def missing(bench: Bench, effect: str, own: dict[str, float], drift: int) -> tuple[Bench, Locus]:
    """Return recordings with an effect, and what the base lacks in a balance, over time."""
    whole = dataclasses.replace(bench, effects=tuple(shipped_effects()))
    hidden = with_effect(whole, effect, own)
    base, layer = based(hidden), hidden.drifts[drift]
    free = freed(hidden, base, layer)
    return hidden, over_time(hidden, locus_of(hidden, "flow", layer, free))


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
    bench: Bench, effect: str, own: dict[str, float], drift: int, acts: list[str]
) -> None:
    assert list(actors(*missing(bench, effect, own, drift))) == acts


def test_a_drift_that_is_not_known_over_time_tells_nothing_but_ripples(bench: Bench) -> None:
    assert not list(actors(bench, Locus("flow", "w_w", 90.0, 2.0)))
    along = (("order 2 of the angle of w_em", 0.8),)
    assert list(actors(bench, Locus("flow", "w_em", 90.0, 2.0, along=along))) == ["inputs.T_em"]


def test_what_is_missing_while_an_input_rests_is_not_that_inputs(bench: Bench) -> None:
    hidden, locus = missing(bench, "road_grade@w_w", {"grade_w_w": 0.05}, 1)
    resting = [dataclasses.replace(one, inputs=one.inputs.copy()) for one in hidden.series]
    for one in resting:
        one.inputs[:, 1] = 0.0
        one.inputs[-5:, 1] = 100.0
    still = dataclasses.replace(hidden, series=tuple(resting))
    assert rests(still, locus, "inputs.T_br")
    assert not rests(still, locus, "flow.w_w")
    assert likely((locus,), ["inputs.T_br"], still)[0].path == "flow.w_w"
    for one in resting:
        one.inputs[:, 1] = 100.0
    assert not rests(still, locus, "inputs.T_br")
    assert likely((locus,), ["inputs.T_br"], still)[0].path == "inputs.T_br"
