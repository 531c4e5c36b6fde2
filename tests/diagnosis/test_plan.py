"""What would tell candidates apart is simulated: the one drives, the other foresees."""

from __future__ import annotations

import numpy as np

from diagnosis.bench import Bench
from diagnosis.layers import fitting
from diagnosis.level import settled, units_of
from diagnosis.manoeuvre import manoeuvres_of
from diagnosis.plan import ENOUGH, planned
from diagnosis.plan_picture import plan_picture
from tests.diagnosis.test_estimation import FRICTION, bench
from tests.diagnosis.test_location import based, with_effect

__all__ = ["bench"]


def test_manoeuvres_are_as_large_as_what_was_recorded(bench: Bench) -> None:
    hidden = with_effect(bench, "coulomb_friction@w_em", FRICTION)
    menu = manoeuvres_of(hidden)
    most = max(float(np.max(np.abs(one.inputs[:, 0]))) for one in hidden.series)
    rows = np.concatenate([one.measured for one in hidden.series])
    assert len(menu) >= 10
    for one in menu:
        assert np.max(np.abs(one.series.inputs[:, 0])) <= most + 1e-9
        assert np.any(np.all(rows == one.series.measured[0], axis=1))  # a start that was seen
    assert manoeuvres_of(bench) == []  # nothing was driven there


def test_a_model_is_not_told_from_itself_but_from_one_without_friction(bench: Bench) -> None:
    hidden = with_effect(bench, "coulomb_friction@w_em", FRICTION)
    base = based(hidden)
    layers = {one.id: one for e in bench.effects for one in fitting(bench.document, e)}
    candidate = hidden.candidate((layers["coulomb_friction@w_em"],))
    units = units_of(base.candidate, hidden.series, base.values(0))
    start = {**base.values(0), "T_c_w_em": 1.0}
    friction = settled(candidate, hidden.series, base.noises, start, units)
    same = planned(hidden, [("a", friction), ("b", friction)])
    assert same is not None
    assert same.options[0].nats < 1.0
    assert not same.tells
    assert same.sentence() == "no manoeuvre that was tried would tell a from b"
    plan = planned(hidden, [("friction", friction), ("none", base)])
    assert plan is not None
    assert plan.tells
    nats = [option.nats for option in plan.options]
    assert nats == sorted(nats, reverse=True)
    assert nats[0] > max(ENOUGH, 3.0 * nats[-1])
    assert plan.sentence().startswith("to tell friction from none, record: ")
    picture = plan_picture(
        plan, {"T_em": "N*m", "T_br": "N*m"}, [("w_em", "rad/s"), ("w_s", "rad/s")]
    )
    assert b"friction" in picture.data("svg")
    assert planned(hidden, [("friction", friction)]) is None
