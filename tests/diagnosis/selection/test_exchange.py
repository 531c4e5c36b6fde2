"""What was accepted first stands aside for what goes better with the others, known or not."""

from __future__ import annotations

import dataclasses

import pytest

from diagnosis.criterion.likelihood_gain import LikelihoodGain, likelihood_gain
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import disturbance_units, fit_with_noise
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.exchange import exchange_effects
from tests.diagnosis.estimation.test_levenberg_marquardt import TRUTH, bench, simulate_recordings
from tests.diagnosis.localisation.test_ranking import fit_first_base
from tests.diagnosis.selection.test_backward_elimination import FRICTION, STARTS, find_layer

__all__ = ["bench"]
LAG, DELAY, OFFSET = "sensor_lag@w_s", "sensor_delay@w_s", "sensor_offset@w_s"


@pytest.fixture(name="late")
def late_and_rubbing(bench: ModelSet) -> tuple[ModelSet, list[CandidateFit]]:
    """A late sensor and friction; accepted were a lag and friction."""
    true = bench.compile_candidate([find_layer(bench, DELAY), find_layer(bench, FRICTION)])
    series = simulate_recordings(true, {**TRUTH, "T_d_w_s": 0.03, "T_c_w_em": 3.0})
    used = dataclasses.replace(bench, series=series, _compiled={})
    base = fit_first_base(used)
    units = disturbance_units(base.candidate, series, base.values(0))
    start = {**base.values(0), **STARTS}
    lag, both = (
        fit_with_noise(used.compile_candidate(layers), series, base.noise_levels, start, units)
        for layers in (
            [find_layer(bench, LAG)],
            [find_layer(bench, LAG), find_layer(bench, FRICTION)],
        )
    )
    first = CandidateFit(find_layer(bench, LAG), 0.0, lag, likelihood_gain(lag, base, series))
    return used, [
        first,
        CandidateFit(find_layer(bench, FRICTION), 0.0, both, likelihood_gain(both, lag, series)),
    ]


@pytest.mark.long
@pytest.mark.parametrize(("name", "goes_better"), [(DELAY, True), (OFFSET, False)])
def test_what_it_is_confused_with_is_tried_though_it_was_not_fitted(
    bench: ModelSet, late: tuple[ModelSet, list[CandidateFit]], name: str, goes_better: bool
) -> None:
    """Alone it promised nothing; an effect that it is not confused with stays away."""
    used, accepted = late
    model = accepted[-1].estimate
    told: list[str] = []
    assert model is not None
    units = disturbance_units(model.candidate, used.series, model.values(0))
    rivals = [accepted[0], CandidateFit(find_layer(bench, name), -5.0)]
    kept, better = exchange_effects(used, model, accepted, rivals, units, told.append)
    assert [one.placed_effect.id for one in kept] == [name if goes_better else LAG, FRICTION]
    assert bool(told) is goes_better
    assert (better.cost < model.cost - 100.0) is goes_better
    before, after = accepted[0].likelihood_gain, kept[0].likelihood_gain
    assert before is not None
    assert after is not None
    assert (after.penalised > before.penalised + 100.0) is goes_better


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "part", "is_tried"),
    [
        ("sensor_delay@w_s", 0.3, True),
        ("sensor_delay@w_s", 0.2, False),
        ("sensor_offset@w_s", 0.3, False),
    ],
)
def test_what_it_is_confused_with_may_have_gained_less(
    bench: ModelSet,
    late: tuple[ModelSet, list[CandidateFit]],
    name: str,
    part: float,
    is_tried: bool,
) -> None:
    """A delay gained four tenths of what a lag did, until what both hid was found."""
    used, accepted = late
    old, model = accepted[0], accepted[-1].estimate
    assert old.likelihood_gain is not None
    assert model is not None
    gained = LikelihoodGain(
        part * old.likelihood_gain.penalised,
        part * old.likelihood_gain.cross_validated,
        old.likelihood_gain.by_recording,
    )
    rival = CandidateFit(find_layer(bench, name), 1.0, None, gained)
    units = disturbance_units(model.candidate, used.series, model.values(0))
    kept, _ = exchange_effects(used, model, accepted, [rival], units, lambda text: None)
    assert (kept[0].placed_effect.id == name) is is_tried
