"""What was accepted beside the first effect where that acts, and what leads a place."""

from __future__ import annotations

import dataclasses

import pytest

from diagnosis.bench import Bench
from diagnosis.company import company_of, has_hidden
from diagnosis.layers import fitting, shipped_effects
from diagnosis.location import likely
from diagnosis.locus import Locus
from diagnosis.search import Tried
from diagnosis.selection import Selection
from tests.diagnosis.test_adequacy import accepting, rubbing
from tests.diagnosis.test_estimation import bench

__all__ = ["bench", "rubbing"]


def with_second(bench: Bench, selection: Selection, effect: str, part: float) -> Selection:
    """Return a selection with a second effect that gained `part` of what the first one did."""
    (first,) = selection.accepted
    assert first.evidence is not None
    layers = {layer.id: layer for e in shipped_effects() for layer in fitting(bench.document, e)}
    gained = dataclasses.replace(first.evidence, train=part * first.evidence.train)
    second = Tried(layers[effect], 1.0, first.estimate, gained)
    return dataclasses.replace(selection, accepted=(first, second))


@pytest.mark.parametrize(
    ("second", "is_company"),
    [
        ("stribeck_friction@w_em", True),
        ("torque_gain@T_em", True),
        ("unknown_input@w_em", True),
        ("unknown_input@w_w", False),
        ("sensor_lag@w_s", False),
    ],
)
def test_company_acts_where_the_first_effect_does(
    bench: Bench, rubbing: Bench, second: str, is_company: bool
) -> None:
    alone = accepting(bench, rubbing, "coulomb_friction@w_em")
    both = with_second(bench, alone, second, 0.3)
    assert [one.layer.id for one in company_of(rubbing, both)] == [second] * is_company
    assert company_of(rubbing, alone) == ()
    assert has_hidden(both) is second.startswith("unknown_input")


@pytest.mark.parametrize(
    ("feature", "correlation", "leads"),
    [
        ("order 2 of the angle of w_em", 0.8, "inputs.T_em"),
        ("order 2 of the angle of w_em", 0.4, "flow.w_em"),
        ("order 2 of the angle of w_w", 0.8, "flow.w_em"),
        ("the sign of w_em", 0.8, "flow.w_em"),
    ],
)
def test_what_ripples_with_an_angle_is_led_by_the_input_there(
    bench: Bench, feature: str, correlation: float, leads: str
) -> None:
    first = Locus("flow", "w_em", 90.0, 2.0, along=((feature, correlation),))
    rest = Locus("elements", "half_shaft", 10.0, 2.0)
    assert likely((first, rest), (), bench)[0].path == leads
