"""What is at a limit that was set to it gives way to what gains nearly as much at its place."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from diagnosis.criterion.likelihood_gain import LikelihoodGain
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.model.parameter_vector import ParameterVector, bounds_of
from diagnosis.pipeline.decision import _rejection_reason
from diagnosis.selection.bound_score import is_at_bound, prefer_interior
from diagnosis.selection.candidate_search import CandidateFit
from tests.diagnosis.estimation.test_levenberg_marquardt import bench
from tests.diagnosis.selection.test_backward_elimination import FRICTION, find_layer
from tests.diagnosis.validation.test_adequacy import rubbing, select_effect

__all__ = ["bench", "rubbing"]
LAG, DELAY = "sensor_lag@w_s", "sensor_delay@w_s"


def at_end(bench: ModelSet, model: Estimate, effect: str, parameter: str, end: int) -> Estimate:
    """Return a model with an effect, a parameter of which is at an end of its range (0 or 1)."""
    candidate = bench.compile_candidate([find_layer(bench, effect)])
    shared = np.zeros(len(candidate.names))
    k = list(candidate.names).index(parameter)
    shared[k] = bounds_of(candidate)[k, end]
    return dataclasses.replace(
        model, candidate=candidate, point=ParameterVector(shared, shared[None])
    )


@pytest.mark.parametrize(
    ("effect", "parameter", "end", "is_set"),
    [
        (FRICTION, "T_c_w_em", 0, False),
        (FRICTION, "T_c_w_em", 1, True),
        (FRICTION, "J_em", 1, False),
        (LAG, "part_w_s", 0, False),
        (LAG, "part_w_s", 1, False),
        (LAG, "tau_w_s", 1, True),
    ],
)
def test_a_limit_is_one_that_was_set_to_a_parameter_of_the_effect(
    bench: ModelSet, rubbing: ModelSet, effect: str, parameter: str, end: int, is_set: bool
) -> None:
    model = select_effect(bench, rubbing, FRICTION).model
    limited = at_end(bench, model, effect, parameter, end)
    assert is_at_bound(limited, find_layer(bench, effect)) is is_set
    assert not is_at_bound(None, find_layer(bench, effect))


@pytest.mark.parametrize(
    ("gain", "end", "beside", "named"),
    [
        (950.0, 1, DELAY, DELAY),
        (850.0, 1, DELAY, LAG),
        (950.0, 0, DELAY, LAG),
        (950.0, 1, FRICTION, LAG),
    ],
)
def test_what_is_at_a_limit_gives_way_to_what_gains_nearly_as_much(
    bench: ModelSet, rubbing: ModelSet, gain: float, end: int, beside: str, named: str
) -> None:
    model = select_effect(bench, rubbing, FRICTION).model
    parameter = "tau_w_s" if end else "part_w_s"
    limited = at_end(bench, model, LAG, parameter, end)
    best = CandidateFit(
        find_layer(bench, LAG), 0.0, limited, LikelihoodGain(1000.0, 1000.0, (1000.0,))
    )
    other = CandidateFit(find_layer(bench, beside), 0.0, model, LikelihoodGain(gain, gain, (gain,)))
    found = prefer_interior(best, [best, other])
    assert found.placed_effect.id == named
    assert (found is best) is (named == LAG)
    blind = dataclasses.replace(best, likelihood_gain=None)
    assert prefer_interior(blind, [other]) is blind


@pytest.mark.parametrize(("end", "why"), [(1, "the first is at the end of a range"), (0, "")])
def test_a_first_name_that_ends_at_a_limit_is_none(
    bench: ModelSet, rubbing: ModelSet, end: int, why: str
) -> None:
    selection = select_effect(bench, rubbing, FRICTION)
    model = at_end(bench, selection.model, FRICTION, "T_c_w_em", end)
    limited = dataclasses.replace(
        selection, model=dataclasses.replace(model, normal_equations=None)
    )
    assert _rejection_reason(limited, rubbing) == why
    hidden = CandidateFit(
        find_layer(bench, "unknown_input@w_w"), 0.0, limited.model, LikelihoodGain(1.0, 1.0, (1.0,))
    )
    beside = dataclasses.replace(limited, accepted=(*limited.accepted, hidden))
    assert beside.has_unknown_input
    assert _rejection_reason(beside, rubbing) == why


@pytest.mark.parametrize(
    ("rule", "why"),
    [
        ("rejects_bounds", "they are pulled out of their ranges"),
        ("rejects_constancy", "the parameters of the first differ from recording to recording"),
        ("has_autocorrelated_residuals_in_most", "most recordings remember what is left"),
    ],
)
def test_beside_a_hidden_input_what_is_left_does_not_count(
    bench: ModelSet, rubbing: ModelSet, monkeypatch: pytest.MonkeyPatch, rule: str, why: str
) -> None:
    """It takes up anything at all: its own form is never quite right."""
    monkeypatch.setattr(f"diagnosis.pipeline.decision.{rule}", lambda *of: True)
    alone = select_effect(bench, rubbing, FRICTION)
    assert _rejection_reason(alone, rubbing) == why
    hidden = CandidateFit(
        find_layer(bench, "unknown_input@w_w"), 0.0, alone.model, alone.accepted[0].likelihood_gain
    )
    assert (
        _rejection_reason(dataclasses.replace(alone, accepted=(*alone.accepted, hidden)), rubbing)
        == ""
    )
