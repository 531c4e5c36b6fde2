"""Whether a further effect can gain anything is told by free drifts before one is looked for."""

from __future__ import annotations

import dataclasses

import pytest

from diagnosis.bench import Bench
from diagnosis.layers import fitting, shipped_effects
from diagnosis.level import settled, units_of
from diagnosis.room import drifts_gain, is_full, room_left
from diagnosis.selection import selected
from diagnosis.threshold import USUAL
from tests.diagnosis.test_adequacy import accepting, rubbing
from tests.diagnosis.test_estimation import bench
from tests.diagnosis.test_location import based

__all__ = ["bench", "rubbing"]


def test_a_model_with_what_is_missing_leaves_no_room(bench: Bench, rubbing: Bench) -> None:
    selection = accepting(bench, rubbing, "coulomb_friction@w_em")
    units = units_of(selection.model.candidate, rubbing.series, selection.model.values(0))
    assert is_full(rubbing, selection.model, units, USUAL)
    quiet = dataclasses.replace(selection.base.noises, drifts={})
    base = selection.base
    alone = settled(base.candidate, rubbing.series, quiet, base.point, {})
    assert room_left(rubbing, alone) > USUAL
    assert not is_full(rubbing, alone, units, USUAL)


def test_a_drift_that_has_much_to_do_may_stand_for_an_effect(bench: Bench, rubbing: Bench) -> None:
    model = accepting(bench, rubbing, "coulomb_friction@w_em").model
    units = units_of(model.candidate, rubbing.series, model.values(0))
    drifts = {**model.noises.drifts, "drift_balance_w_w": 2.0 * units["drift_balance_w_w"]}
    noises = dataclasses.replace(model.noises, drifts=drifts)
    assert not is_full(rubbing, dataclasses.replace(model, noises=noises), units, USUAL)


def test_drifts_that_do_not_go_along_with_an_effect_are_left_out(bench: Bench) -> None:
    layers = {layer.id: layer for e in shipped_effects() for layer in fitting(bench.document, e)}
    base = based(bench)
    candidate = bench.candidate((layers["sensor_delay@w_s"],))
    units = units_of(candidate, bench.series, base.values(0))
    model = settled(candidate, bench.series, base.noises, base.values(0), units)
    assert room_left(bench, model) < float("inf")
    assert drifts_gain(bench, model, bench.drifts) > -float("inf")


def test_no_further_effect_is_looked_for_where_there_is_no_room(
    bench: Bench, rubbing: Bench
) -> None:
    own = dataclasses.replace(rubbing, effects=bench.effects, _made={})
    base = based(own)
    told: list[str] = []
    units = units_of(base.candidate, own.series, base.values(0))
    found = selected(own, base, units, tell=told.append)
    assert [one.layer.effect.name for one in found.accepted] == ["coulomb_friction"]
    assert any("no further effect is looked for" in text for text in told)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("diagnosis.selection.is_full", lambda *_: False)
        again = selected(own, base, units)
    assert [one.layer.id for one in again.accepted] == [one.layer.id for one in found.accepted]
