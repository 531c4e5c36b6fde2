"""What would tell candidates apart is simulated: the one drives, the other foresees."""

from __future__ import annotations

import numpy as np

from diagnosis.estimation.levenberg_marquardt import estimate_parameters
from diagnosis.estimation.model_set import ModelSet
from diagnosis.experiment.discrimination import MIN_LOG_BAYES_FACTOR, plan_experiment
from diagnosis.experiment.manoeuvre import manoeuvres_for
from diagnosis.report.figures import draw_experiment
from tests.diagnosis.estimation.test_levenberg_marquardt import FRICTION, bench, place_effect
from tests.diagnosis.localisation.test_ranking import fit_first_base, with_effect

__all__ = ["bench"]


def test_manoeuvres_are_as_large_as_what_was_recorded(bench: ModelSet) -> None:
    hidden = with_effect(bench, "coulomb_friction@w_em", FRICTION)
    menu = manoeuvres_for(hidden)
    most = max(float(np.max(np.abs(one.inputs[:, 0]))) for one in hidden.series)
    rows = np.concatenate([one.measured for one in hidden.series])
    assert len(menu) >= 10
    for one in menu:
        assert np.max(np.abs(one.series.inputs[:, 0])) <= most + 1e-9
        assert np.any(np.all(rows == one.series.measured[0], axis=1))  # a start that was seen
    assert manoeuvres_for(bench) == []  # nothing was driven there


def test_a_model_is_not_told_from_itself_but_from_one_without_friction(bench: ModelSet) -> None:
    hidden = with_effect(bench, "coulomb_friction@w_em", FRICTION)
    base = fit_first_base(hidden)
    candidate = hidden.compile_candidate((place_effect(bench, "coulomb_friction@w_em"),))
    start = {**base.values(0), "T_c_w_em": 1.0}
    friction = estimate_parameters(candidate, hidden.series, base.noise_levels, start)
    same = plan_experiment(hidden, [("a", friction), ("b", friction)])
    assert same is not None
    assert same.options[0].log_bayes_factor < 1.0
    assert not same.is_discriminating
    assert same.format_sentence() == "no manoeuvre that was tried would tell a from b"
    plan = plan_experiment(hidden, [("friction", friction), ("none", base)])
    assert plan is not None
    assert plan.is_discriminating
    nats = [option.log_bayes_factor for option in plan.options]
    assert nats == sorted(nats, reverse=True)
    assert nats[0] > max(MIN_LOG_BAYES_FACTOR, 3.0 * nats[-1])
    assert plan.format_sentence().startswith("to tell friction from none, record: ")
    picture = draw_experiment(
        plan, {"T_em": "N*m", "T_br": "N*m"}, [("w_em", "rad/s"), ("w_s", "rad/s")]
    )
    assert b"friction" in picture.data("svg")
    assert plan_experiment(hidden, [("friction", friction)]) is None
