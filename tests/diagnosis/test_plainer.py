"""Friction that rises at rest gives way to dry friction where its rise is none."""

from __future__ import annotations

import dataclasses

import pytest

from diagnosis.bench import Bench
from diagnosis.estimate import Estimate
from diagnosis.evidence import Evidence, evidence
from diagnosis.form import shown_form
from diagnosis.layers import fitting, shipped_effects
from diagnosis.level import settled, units_of
from diagnosis.plainer import AHEAD, led_by, may_be_plainer, plainer_ones
from diagnosis.search import Tried
from tests.diagnosis.test_estimation import bench
from tests.diagnosis.test_location import based, with_effect
from tests.diagnosis.test_needed import layer

__all__ = ["bench"]
RISES, PLAIN = "stribeck_friction@w_em", "coulomb_friction@w_em"


def rubbing(bench: Bench, rise: float) -> Bench:
    """Return recordings with a friction at the motor that rises by a part of itself at rest."""
    every = dataclasses.replace(bench, effects=shipped_effects(), _made={})
    true = {"T_c_w_em": 5.0, "rise_w_em": rise, "w_k_w_em": 60.0}
    return dataclasses.replace(with_effect(every, RISES, true), effects=every.effects)


def tried(own: Bench, base: Estimate, effect: str) -> Tried:
    """Return an effect fitted beside a base."""
    layers = {layer.id: layer for e in own.effects for layer in fitting(own.document, e)}
    units = units_of(base.candidate, own.series, base.values(0))
    candidate = own.candidate((layers[effect],))
    model = settled(candidate, own.series, base.noises, base.values(0), units)
    known = evidence(model, base, own.series)
    return Tried(layers[effect], known.train, model, known)


@pytest.mark.long
@pytest.mark.parametrize(("rise", "named"), [(0.0, PLAIN), (3.0, RISES)])
def test_the_form_that_recordings_show_is_named(bench: Bench, rise: float, named: str) -> None:
    own = rubbing(bench, rise)
    base = based(own)
    units = units_of(base.candidate, own.series, base.values(0))
    full, plain = tried(own, base, RISES), tried(own, base, PLAIN)
    assert full.estimate is not None
    assert may_be_plainer(full.estimate, full.layer, own.series) is (named == PLAIN)
    for best, other in ((full, plain), (plain, full)):
        assert shown_form(own, base, units, best, [best, other]).layer.id == named
        unfitted = Tried(other.layer, 0.0)
        assert shown_form(own, base, units, best, [best, unfitted]).layer.id == named
        assert shown_form(own, base, units, best, [best]) is best, "there is no other form"


def test_a_form_is_fitted_from_where_the_other_is(bench: Bench) -> None:
    """One that was left where it fits badly is not the reason why the other one is named."""
    own = rubbing(bench, 3.0)
    base = based(own)
    units = units_of(base.candidate, own.series, base.values(0))
    full, plain = tried(own, base, RISES), tried(own, base, PLAIN)
    assert full.estimate is not None
    lost = dataclasses.replace(full, estimate=dataclasses.replace(full.estimate, cost=1e9))
    found = shown_form(own, base, units, plain, [plain, lost])
    assert found.layer.id == RISES
    assert found.estimate is not None
    assert found.estimate.cost < full.estimate.cost + 1.0


def test_a_plainer_one_gains_nearly_as_much_at_the_same_place(bench: Bench) -> None:
    own = rubbing(bench, 0.0)
    base = based(own)
    best, other = tried(own, base, RISES), tried(own, base, PLAIN)
    assert best.evidence is not None
    assert other.evidence is not None
    assert list(plainer_ones(best, [best, other])) == [other]
    weak = dataclasses.replace(other.evidence, train=0.5 * best.evidence.train)
    assert not list(plainer_ones(best, [dataclasses.replace(other, evidence=weak)]))
    away = dataclasses.replace(other.layer, place="w_w")
    assert not list(plainer_ones(best, [dataclasses.replace(other, layer=away)]))
    assert not list(plainer_ones(other, [best]))


@pytest.mark.parametrize(("gain", "is_put_ahead"), [(900.0, True), (1100.0, False)])
def test_what_others_gave_way_to_leads_them(bench: Bench, gain: float, is_put_ahead: bool) -> None:
    own = rubbing(bench, 0.0)
    both = tried(own, based(own), PLAIN)
    known = Evidence(gain, gain, (gain,))
    plain = dataclasses.replace(both, evidence=known)
    rising = Tried(layer(own, RISES), 0.0, both.estimate, Evidence(1000.0, 1000.0, (1000.0,)))
    far = dataclasses.replace(rising, layer=layer(own, "sensor_lag@w_s"))
    lead, ranked = led_by(plain, [rising, plain, far])
    assert {one.layer.id for one in ranked} == {PLAIN, RISES, far.layer.id}
    assert lead.evidence is known, "what was measured stays"
    assert (lead.lead > 0.0) is is_put_ahead
    assert lead.score == pytest.approx(max(plain.score, rising.score + AHEAD))
    assert ranked[0] is lead
