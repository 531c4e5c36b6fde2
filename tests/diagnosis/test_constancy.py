"""What comes late alone has the same time in each recording, or is something else."""

from __future__ import annotations

import dataclasses

import pytest

from diagnosis.bench import Bench
from diagnosis.constancy import comes_late, differs, shown_variation, variation
from diagnosis.layers import fitting, shipped_effects
from tests.diagnosis.test_adequacy import accepting, rubbing
from tests.diagnosis.test_estimation import TRUTH, bench, recorded
from tests.diagnosis.test_needed import FRICTION, layer

__all__ = ["bench", "rubbing"]


def test_lags_and_delays_come_late_and_nothing_else_does(bench: Bench) -> None:
    laid = [one for effect in shipped_effects() for one in fitting(bench.document, effect)]
    late = {one.effect.name for one in laid if comes_late(one)}
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
    bench: Bench,
    rubbing: Bench,
    effect: str,
    part: float,
    is_alone: bool,
    is_other: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of an effect whose own values in each recording would gain a part of what it gained."""
    selection = accepting(bench, rubbing, FRICTION)
    (known,) = selection.accepted
    assert known.evidence is not None
    gained = dataclasses.replace(known.evidence, train=10_000.0)
    tried = dataclasses.replace(known, layer=layer(bench, effect), evidence=gained)
    for one in ("variation", "shown_variation"):
        monkeypatch.setattr(f"diagnosis.constancy.{one}", lambda *of: part * 10_000.0)
    assert differs(selection.model, tried, rubbing.series, is_alone) is is_other


def test_what_an_effect_gains_beside_the_others_counts_where_that_is_more(
    bench: Bench, rubbing: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Found while a delay was missing too, a tyre gained 1500 nats of 25 000."""
    selection = accepting(bench, rubbing, FRICTION)
    (known,) = selection.accepted
    assert known.evidence is not None
    tried = dataclasses.replace(known, evidence=dataclasses.replace(known.evidence, train=1500.0))
    for one in ("variation", "shown_variation"):
        monkeypatch.setattr(f"diagnosis.constancy.{one}", lambda *of: 400.0)
    assert differs(selection.model, tried, rubbing.series, False)
    beside = dataclasses.replace(tried, beside=25_000.0)
    assert not differs(selection.model, beside, rubbing.series, False)


@pytest.mark.parametrize("apart", [0.0, 1.5])
def test_what_is_foreseen_of_values_of_their_own_is_shown_where_they_are(
    bench: Bench, apart: float
) -> None:
    """Half of the recordings have less friction than the others, or all the same."""
    true = bench.candidate([layer(bench, FRICTION)])
    small, large = (recorded(true, {**TRUTH, "T_c_w_em": 4.0 + by}) for by in (-apart, apart))
    mixed = tuple((small, large)[k % 2][k] for k in range(len(small)))
    used = dataclasses.replace(bench, series=mixed, _made={})
    selection = accepting(bench, used, FRICTION)
    (first,) = selection.accepted
    given = selection.model, first.layer, used.series
    foreseen, shown = variation(*given), shown_variation(*given)
    if apart:
        assert shown == pytest.approx(foreseen, rel=0.3)
        assert shown > 40.0
    else:
        assert abs(shown) < 15.0
    nothing = dataclasses.replace(selection.model, normal=None)
    assert shown_variation(nothing, first.layer, used.series) == 0.0


def test_what_is_foreseen_and_not_shown_is_no_difference(
    bench: Bench, rubbing: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a friction that bends the normal equations promised 227 nats, 19 were there."""
    selection = accepting(bench, rubbing, FRICTION)
    (known,) = selection.accepted
    monkeypatch.setattr("diagnosis.constancy.variation", lambda *of: 1e6)
    assert not differs(selection.model, known, rubbing.series, True)
