"""What an effect stood in for has its place and what it gained; what is worth most comes first."""

from __future__ import annotations

import pytest

from diagnosis.criterion.likelihood_gain import LikelihoodGain, likelihood_gain, subtract_gains
from diagnosis.criterion.threshold import DEFAULT_THRESHOLDS
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import disturbance_units, fit_with_noise
from diagnosis.model.placed_effect import PlacedEffect, find_placements, shipped_effects
from diagnosis.selection.backward_elimination import (
    AcceptedEffects,
    eliminate_backward,
    update_first_round,
)
from diagnosis.selection.candidate_search import CandidateFit
from tests.diagnosis.estimation.test_levenberg_marquardt import TRUTH, bench, simulate_recordings
from tests.diagnosis.localisation.test_ranking import fit_first_base

__all__ = ["bench"]
LAG, DELAY = "sensor_lag@w_s", "sensor_delay@w_s"
DRAG, FRICTION = "quadratic_drag@w_em", "coulomb_friction@w_em"

STARTS = {"tau_w_s": 0.01, "T_d_w_s": 0.01, "T_c_w_em": 1.0, "c_2_w_em": 1e-5}


def find_layer(bench: ModelSet, name: str) -> PlacedEffect:
    effect = next(e for e in shipped_effects() if e.name == name.partition("@")[0])
    return next(one for one in find_placements(bench.document, effect) if one.id == name)


def looked_at_after(
    bench: ModelSet, own: dict[str, float], first: str, second: str
) -> AcceptedEffects:
    """What is needed of two effects, the second found after the first, where the second acts, or
    both.
    """
    layers = [find_layer(bench, one) for one in (first, second)]
    true = layers if len(own) == len(layers) else layers[1:]
    series = simulate_recordings(bench.compile_candidate(tuple(true)), {**TRUTH, **own})
    used = ModelSet(
        bench.document,
        bench.project,
        bench.automaton,
        (),
        series,
        bench.output_names,
        bench.disturbances,
    )
    base = fit_first_base(used)
    units = disturbance_units(base.candidate, series, base.values(0))

    def fitted(count: int) -> Estimate:
        start = {**base.values(0), **STARTS}
        return fit_with_noise(
            used.compile_candidate(tuple(layers[:count])), series, base.noise_levels, start, units
        )

    one, both = fitted(1), fitted(2)
    tried = (
        CandidateFit(layers[0], 0.0, one, likelihood_gain(one, base, series)),
        CandidateFit(layers[1], 0.0, both, likelihood_gain(both, one, series)),
    )
    return eliminate_backward(
        used, AcceptedEffects(base, both, tried), units, DEFAULT_THRESHOLDS, lambda text: None
    )


@pytest.mark.long
def test_a_stand_in_goes_and_what_it_gained_is_that_of_the_other(bench: ModelSet) -> None:
    found = looked_at_after(bench, {"T_d_w_s": 0.03}, LAG, DELAY)
    (kept,) = found.effects
    assert kept.placed_effect.id == DELAY
    assert kept.likelihood_gain is not None
    assert kept.likelihood_gain.penalised > 300.0
    assert kept.estimate is found.model
    assert found.model.values(0)["T_d_w_s"] == pytest.approx(0.03, rel=0.1)
    before = [CandidateFit(find_layer(bench, one), 5.0) for one in (LAG, DELAY)]
    out, leading = update_first_round(before, before, found.effects)
    assert (out.estimate, leading) == (None, kept)


def test_what_is_worth_most_at_a_place_comes_first(bench: ModelSet) -> None:
    found = looked_at_after(bench, {"c_2_w_em": 2e-4, "T_c_w_em": 2.0}, DRAG, FRICTION)
    assert [one.placed_effect.id for one in found.effects] == [FRICTION, DRAG]
    first, last = (one.likelihood_gain for one in found.effects)
    assert first is not None
    assert last is not None
    assert min(first.penalised, last.penalised) > 45.0
    assert found.model.values(0)["T_c_w_em"] == pytest.approx(2.0, rel=0.1)


def test_what_is_kept_knows_what_it_gains_beside_the_others(bench: ModelSet) -> None:
    found = looked_at_after(bench, {"T_d_w_s": 0.03, "T_c_w_em": 2.0}, DELAY, FRICTION)
    first, last = found.effects
    assert (first.placed_effect.id, last.placed_effect.id) == (DELAY, FRICTION)
    assert first.joint_gain > 300.0
    assert last.joint_gain == 0.0  # not looked for: it was found beside the first
    assert last.likelihood_gain is not None
    assert last.gain == last.likelihood_gain.penalised
    assert first.gain >= first.joint_gain


def test_a_gain_less_others_is_what_is_left() -> None:
    whole, part = LikelihoodGain(10.0, 9.0, (4.0, 5.0)), LikelihoodGain(3.0, 2.0, (1.5, 0.5))
    assert subtract_gains(whole, [part]) == LikelihoodGain(7.0, 7.0, (2.5, 4.5))
    assert subtract_gains(whole, []) == whole
