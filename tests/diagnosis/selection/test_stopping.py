"""Whether a further effect can gain anything is told by free drifts before one is looked for."""

from __future__ import annotations

import dataclasses

import pytest

from diagnosis.criterion.threshold import DEFAULT_THRESHOLD
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import disturbance_units, fit_with_noise
from diagnosis.model.placed_effect import find_placements, shipped_effects
from diagnosis.selection.forward_selection import select_effects
from diagnosis.selection.stopping import disturbance_gain, further_gain_bound, meets_stopping_rule
from tests.diagnosis.estimation.test_levenberg_marquardt import bench
from tests.diagnosis.localisation.test_ranking import fit_first_base
from tests.diagnosis.validation.test_adequacy import rubbing, select_effect

__all__ = ["bench", "rubbing"]


def test_a_model_with_what_is_missing_leaves_no_room(bench: ModelSet, rubbing: ModelSet) -> None:
    selection = select_effect(bench, rubbing, "coulomb_friction@w_em")
    units = disturbance_units(selection.model.candidate, rubbing.series, selection.model.values(0))
    assert meets_stopping_rule(rubbing, selection.model, units, DEFAULT_THRESHOLD)
    quiet = dataclasses.replace(selection.base.noise_levels, process={})
    base = selection.base
    alone = fit_with_noise(base.candidate, rubbing.series, quiet, base.point, {})
    assert further_gain_bound(rubbing, alone) > DEFAULT_THRESHOLD
    assert not meets_stopping_rule(rubbing, alone, units, DEFAULT_THRESHOLD)


def test_a_drift_that_has_much_to_do_may_stand_for_an_effect(
    bench: ModelSet, rubbing: ModelSet
) -> None:
    model = select_effect(bench, rubbing, "coulomb_friction@w_em").model
    units = disturbance_units(model.candidate, rubbing.series, model.values(0))
    drifts = {**model.noise_levels.process, "drift_balance_w_w": 2.0 * units["drift_balance_w_w"]}
    noises = dataclasses.replace(model.noise_levels, process=drifts)
    assert not meets_stopping_rule(
        rubbing, dataclasses.replace(model, noise_levels=noises), units, DEFAULT_THRESHOLD
    )


def test_drifts_that_do_not_go_along_with_an_effect_are_left_out(bench: ModelSet) -> None:
    layers = {
        layer.id: layer for e in shipped_effects() for layer in find_placements(bench.document, e)
    }
    base = fit_first_base(bench)
    candidate = bench.compile_candidate((layers["sensor_delay@w_s"],))
    units = disturbance_units(candidate, bench.series, base.values(0))
    model = fit_with_noise(candidate, bench.series, base.noise_levels, base.values(0), units)
    assert further_gain_bound(bench, model) < float("inf")
    assert disturbance_gain(bench, model, bench.disturbances) > -float("inf")


@pytest.mark.long
def test_no_further_effect_is_looked_for_where_there_is_no_room(
    bench: ModelSet, rubbing: ModelSet
) -> None:
    own = dataclasses.replace(rubbing, effects=bench.effects, _compiled={})
    base = fit_first_base(own)
    told: list[str] = []
    units = disturbance_units(base.candidate, own.series, base.values(0))
    found = select_effects(own, base, units, log=told.append)
    assert [one.placed_effect.effect.name for one in found.accepted] == ["coulomb_friction"]
    assert any("no further effect is looked for" in text for text in told)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("diagnosis.selection.forward_selection.meets_stopping_rule", lambda *_: False)
        again = select_effects(own, base, units)
    assert [one.placed_effect.id for one in again.accepted] == [
        one.placed_effect.id for one in found.accepted
    ]
