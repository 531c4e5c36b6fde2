"""Friction that rises at rest gives way to dry friction where its rise is none."""

from __future__ import annotations

import dataclasses

import pytest

from diagnosis.criterion.likelihood_gain import LikelihoodGain, likelihood_gain
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import disturbance_units, fit_with_noise
from diagnosis.model.placed_effect import find_placements, shipped_effects
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.nested_form import (
    RESTRICTED_LEAD,
    accepts_restriction,
    choose_form,
    promote_restricted,
    restricted_candidates,
)
from tests.diagnosis.estimation.test_levenberg_marquardt import bench
from tests.diagnosis.localisation.test_ranking import fit_first_base, with_effect
from tests.diagnosis.selection.test_backward_elimination import find_layer

__all__ = ["bench"]
RISES, PLAIN = "stribeck_friction@w_em", "coulomb_friction@w_em"


def rubbing(bench: ModelSet, rise: float) -> ModelSet:
    """Return recordings with a friction at the motor that rises by a part of itself at rest."""
    every = dataclasses.replace(bench, effects=shipped_effects(), _compiled={})
    true = {"T_c_w_em": 5.0, "rise_w_em": rise, "w_k_w_em": 60.0}
    return dataclasses.replace(with_effect(every, RISES, true), effects=every.effects)


def tried(own: ModelSet, base: Estimate, effect: str) -> CandidateFit:
    """Return an effect fitted beside a base."""
    layers = {layer.id: layer for e in own.effects for layer in find_placements(own.document, e)}
    units = disturbance_units(base.candidate, own.series, base.values(0))
    candidate = own.compile_candidate((layers[effect],))
    model = fit_with_noise(candidate, own.series, base.noise_levels, base.values(0), units)
    known = likelihood_gain(model, base, own.series)
    return CandidateFit(layers[effect], known.penalised, model, known)


@pytest.mark.long
@pytest.mark.parametrize(("rise", "named"), [(0.0, PLAIN), (3.0, RISES)])
def test_the_form_that_recordings_show_is_named(bench: ModelSet, rise: float, named: str) -> None:
    own = rubbing(bench, rise)
    base = fit_first_base(own)
    units = disturbance_units(base.candidate, own.series, base.values(0))
    full, plain = tried(own, base, RISES), tried(own, base, PLAIN)
    assert full.estimate is not None
    assert accepts_restriction(full.estimate, full.placed_effect, own.series) is (named == PLAIN)
    for best, other in ((full, plain), (plain, full)):
        assert choose_form(own, base, units, best, [best, other]).placed_effect.id == named
        unfitted = CandidateFit(other.placed_effect, 0.0)
        assert choose_form(own, base, units, best, [best, unfitted]).placed_effect.id == named
        assert choose_form(own, base, units, best, [best]) is best, "there is no other form"


@pytest.mark.long
def test_a_form_is_fitted_from_where_the_other_is(bench: ModelSet) -> None:
    """One that was left where it fits badly is not the reason why the other one is named."""
    own = rubbing(bench, 3.0)
    base = fit_first_base(own)
    units = disturbance_units(base.candidate, own.series, base.values(0))
    full, plain = tried(own, base, RISES), tried(own, base, PLAIN)
    assert full.estimate is not None
    lost = dataclasses.replace(full, estimate=dataclasses.replace(full.estimate, cost=1e9))
    found = choose_form(own, base, units, plain, [plain, lost])
    assert found.placed_effect.id == RISES
    assert found.estimate is not None
    assert found.estimate.cost < full.estimate.cost + 1.0


def test_a_plainer_one_gains_nearly_as_much_at_the_same_place(bench: ModelSet) -> None:
    own = rubbing(bench, 0.0)
    base = fit_first_base(own)
    best, other = tried(own, base, RISES), tried(own, base, PLAIN)
    assert best.likelihood_gain is not None
    assert other.likelihood_gain is not None
    assert list(restricted_candidates(best, [best, other])) == [other]
    weak = dataclasses.replace(
        other.likelihood_gain, penalised=0.5 * best.likelihood_gain.penalised
    )
    assert not list(restricted_candidates(best, [dataclasses.replace(other, likelihood_gain=weak)]))
    away = dataclasses.replace(other.placed_effect, place="w_w")
    assert not list(restricted_candidates(best, [dataclasses.replace(other, placed_effect=away)]))
    assert not list(restricted_candidates(other, [best]))


@pytest.mark.parametrize(("gain", "is_put_ahead"), [(900.0, True), (1100.0, False)])
def test_what_others_gave_way_to_leads_them(
    bench: ModelSet, gain: float, is_put_ahead: bool
) -> None:
    own = rubbing(bench, 0.0)
    both = tried(own, fit_first_base(own), PLAIN)
    known = LikelihoodGain(gain, gain, (gain,))
    plain = dataclasses.replace(both, likelihood_gain=known)
    rising = CandidateFit(
        find_layer(own, RISES), 0.0, both.estimate, LikelihoodGain(1000.0, 1000.0, (1000.0,))
    )
    far = dataclasses.replace(rising, placed_effect=find_layer(own, "sensor_lag@w_s"))
    lead, ranked = promote_restricted(plain, [rising, plain, far])
    assert {one.placed_effect.id for one in ranked} == {PLAIN, RISES, far.placed_effect.id}
    assert lead.likelihood_gain is known, "what was measured stays"
    assert (lead.lead > 0.0) is is_put_ahead
    assert lead.score == pytest.approx(max(plain.score, rising.score + RESTRICTED_LEAD))
    assert ranked[0] is lead
