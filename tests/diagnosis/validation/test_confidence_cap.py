"""A name beside others, or whose parameters differ from recording to recording, is less sure."""

from __future__ import annotations

import dataclasses

import pytest

from diagnosis.estimation.model_set import ModelSet
from diagnosis.model.placed_effect import find_placements, shipped_effects
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.forward_selection import Selection
from diagnosis.validation.confidence_cap import PROBABILITY_CAP, cap_probability
from diagnosis.validation.parameter_constancy import has_varying_parameters, heterogeneity_score
from tests.diagnosis.estimation.test_levenberg_marquardt import TRUTH, bench, simulate_recordings
from tests.diagnosis.selection.test_backward_elimination import FRICTION, find_layer
from tests.diagnosis.validation.test_adequacy import rubbing, select_effect

__all__ = ["bench", "rubbing"]


def with_second(bench: ModelSet, selection: Selection, effect: str, part: float) -> Selection:
    """Return a selection with a second effect that gained `part` of what the first one did."""
    (first,) = selection.accepted
    assert first.likelihood_gain is not None
    layers = {
        layer.id: layer for e in shipped_effects() for layer in find_placements(bench.document, e)
    }
    gained = dataclasses.replace(
        first.likelihood_gain, penalised=part * first.likelihood_gain.penalised
    )
    second = CandidateFit(layers[effect], 1.0, first.estimate, gained)
    return dataclasses.replace(selection, accepted=(first, second))


def share(bench: ModelSet, selection: Selection, told: list[str]) -> float:
    """Return the probability of friction."""
    return cap_probability(bench, selection, told.append).probabilities()[FRICTION]


@pytest.mark.parametrize("second", ["torque_gain@T_em", "sensor_lag@w_s", "unknown_input@w_w"])
def test_a_name_that_needs_others_beside_it_is_less_sure(
    bench: ModelSet, rubbing: ModelSet, second: str
) -> None:
    alone, told = select_effect(bench, rubbing, FRICTION), list[str]()
    assert share(rubbing, alone, told) > 0.9
    assert not told
    both = with_second(bench, alone, second, 0.3)
    assert share(rubbing, both, told) == pytest.approx(PROBABILITY_CAP, abs=1e-3)
    assert told == ["less sure: coulomb_friction@w_em: it needs others beside it"]
    assert both.has_unknown_input is second.startswith("unknown_input")
    assert not alone.has_unknown_input


@pytest.mark.parametrize("apart", [0.0, 1.5])
def test_parameters_that_are_not_the_same_in_each_recording_make_a_name_less_sure(
    bench: ModelSet, apart: float
) -> None:
    """Half of the recordings have less friction than the others."""
    true = bench.compile_candidate([find_layer(bench, FRICTION)])
    small, large = (
        simulate_recordings(true, {**TRUTH, "T_c_w_em": 3.0 + by}) for by in (-apart, apart)
    )
    mixed = [(small, large)[k % 2][k] for k in range(len(small))]
    used = dataclasses.replace(bench, series=tuple(mixed), _compiled={})
    selection = select_effect(bench, used, FRICTION)
    (first,) = selection.accepted
    assert has_varying_parameters(selection.model, first, used.series) is (apart > 0.0)
    told: list[str] = []
    probability = share(used, selection, told)
    assert (probability == pytest.approx(PROBABILITY_CAP, abs=1e-3)) is (apart > 0.0)
    assert told == [
        "less sure: coulomb_friction@w_em: its parameters are not the same in each recording"
    ] * (apart > 0.0)


def test_noise_alone_varies_about_nothing(bench: ModelSet, rubbing: ModelSet) -> None:
    """What is to be expected of noise does not count, and what has no parameters varies nothing."""
    selection = select_effect(bench, rubbing, FRICTION)
    (first,) = selection.accepted
    assert abs(heterogeneity_score(selection.model, first.placed_effect, rubbing.series)) < 15.0
    assert (
        heterogeneity_score(
            selection.model, find_layer(bench, "unknown_input@w_em"), rubbing.series
        )
        == 0.0
    )
    unknown = dataclasses.replace(selection.model, normal_equations=None)
    assert heterogeneity_score(unknown, first.placed_effect, rubbing.series) == 0.0
