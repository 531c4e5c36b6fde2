"""What comes late alone has the same time in each recording, or is something else."""

from __future__ import annotations

import dataclasses

import pytest

from diagnosis.estimation.model_set import ModelSet
from diagnosis.model.placed_effect import find_placements, shipped_effects
from diagnosis.validation.parameter_constancy import (
    heterogeneity_score,
    is_lag_or_delay,
    rejects_constancy,
    simulated_heterogeneity,
)
from tests.diagnosis.estimation.test_levenberg_marquardt import TRUTH, bench, simulate_recordings
from tests.diagnosis.selection.test_backward_elimination import FRICTION, find_layer
from tests.diagnosis.validation.test_adequacy import rubbing, select_effect

__all__ = ["bench", "rubbing"]


def test_lags_and_delays_come_late_and_nothing_else_does(bench: ModelSet) -> None:
    laid = [one for effect in shipped_effects() for one in find_placements(bench.document, effect)]
    late = {one.effect.name for one in laid if is_lag_or_delay(one)}
    assert late == {"actuator_delay", "actuator_lag", "sensor_delay", "sensor_lag"}


@pytest.mark.parametrize(
    ("effect", "part", "is_alone", "is_other"),
    [
        ("sensor_lag@w_s", 0.04, True, False),
        ("sensor_lag@w_s", 0.08, True, True),
        ("sensor_lag@w_s", 0.08, False, False),  # what is beside it makes it vary
        ("sensor_lag@w_s", 0.3, False, True),
        (FRICTION, 0.15, True, False),
        (FRICTION, 0.3, True, True),
    ],
)
def test_what_comes_late_alone_is_the_same_in_each_recording(
    bench: ModelSet,
    rubbing: ModelSet,
    effect: str,
    part: float,
    is_alone: bool,
    is_other: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of an effect whose own values in each recording would gain a part of what it gained."""
    selection = select_effect(bench, rubbing, FRICTION)
    (known,) = selection.accepted
    assert known.likelihood_gain is not None
    gained = dataclasses.replace(known.likelihood_gain, penalised=10_000.0)
    tried = dataclasses.replace(
        known, placed_effect=find_layer(bench, effect), likelihood_gain=gained
    )
    for one in ("heterogeneity_score", "simulated_heterogeneity"):
        monkeypatch.setattr(
            f"diagnosis.validation.parameter_constancy.{one}", lambda *of: part * 10_000.0
        )
    assert rejects_constancy(selection.model, tried, rubbing.series, is_alone) is is_other


def test_what_an_effect_gains_beside_the_others_counts_where_that_is_more(
    bench: ModelSet, rubbing: ModelSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Found while a delay was missing too, a tyre gained 1500 nats of 25 000."""
    selection = select_effect(bench, rubbing, FRICTION)
    (known,) = selection.accepted
    assert known.likelihood_gain is not None
    tried = dataclasses.replace(
        known, likelihood_gain=dataclasses.replace(known.likelihood_gain, penalised=1500.0)
    )
    for one in ("heterogeneity_score", "simulated_heterogeneity"):
        monkeypatch.setattr(f"diagnosis.validation.parameter_constancy.{one}", lambda *of: 400.0)
    assert rejects_constancy(selection.model, tried, rubbing.series, False)
    beside = dataclasses.replace(tried, joint_gain=25_000.0)
    assert not rejects_constancy(selection.model, beside, rubbing.series, False)


@pytest.mark.parametrize("apart", [0.0, 1.5])
def test_what_is_foreseen_of_values_of_their_own_is_shown_where_they_are(
    bench: ModelSet, apart: float
) -> None:
    """Half of the recordings have less friction than the others, or all the same."""
    true = bench.compile_candidate([find_layer(bench, FRICTION)])
    small, large = (
        simulate_recordings(true, {**TRUTH, "T_c_w_em": 4.0 + by}) for by in (-apart, apart)
    )
    mixed = tuple((small, large)[k % 2][k] for k in range(len(small)))
    used = dataclasses.replace(bench, series=mixed, _compiled={})
    selection = select_effect(bench, used, FRICTION)
    (first,) = selection.accepted
    given = selection.model, first.placed_effect, used.series
    foreseen, shown = heterogeneity_score(*given), simulated_heterogeneity(*given)
    if apart:
        assert shown == pytest.approx(foreseen, rel=0.3)
        assert shown > 40.0
    else:
        assert abs(shown) < 15.0
    nothing = dataclasses.replace(selection.model, normal_equations=None)
    assert simulated_heterogeneity(nothing, first.placed_effect, used.series) == 0.0


def test_what_is_foreseen_and_not_shown_is_no_difference(
    bench: ModelSet, rubbing: ModelSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a friction that bends the normal equations promised 227 nats, 19 were there."""
    selection = select_effect(bench, rubbing, FRICTION)
    (known,) = selection.accepted
    monkeypatch.setattr(
        "diagnosis.validation.parameter_constancy.heterogeneity_score", lambda *of: 1e6
    )
    assert not rejects_constancy(selection.model, known, rubbing.series, True)
