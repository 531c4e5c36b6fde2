"""What was accepted first stands aside for what goes better with the others, known or not."""

from __future__ import annotations

import dataclasses

import pytest

from diagnosis.bench import Bench
from diagnosis.evidence import Evidence, evidence
from diagnosis.level import settled, units_of
from diagnosis.search import Tried
from diagnosis.swap import swapped
from tests.diagnosis.test_estimation import TRUTH, bench, recorded
from tests.diagnosis.test_location import based
from tests.diagnosis.test_needed import FRICTION, STARTS, layer

__all__ = ["bench"]
LAG, DELAY, OFFSET = "sensor_lag@w_s", "sensor_delay@w_s", "sensor_offset@w_s"


@pytest.fixture(name="late")
def late_and_rubbing(bench: Bench) -> tuple[Bench, list[Tried]]:
    """A late sensor and friction; accepted were a lag and friction."""
    true = bench.candidate([layer(bench, DELAY), layer(bench, FRICTION)])
    series = recorded(true, {**TRUTH, "T_d_w_s": 0.03, "T_c_w_em": 3.0})
    used = dataclasses.replace(bench, series=series, _made={})
    base = based(used)
    units = units_of(base.candidate, series, base.values(0))
    start = {**base.values(0), **STARTS}
    lag, both = (
        settled(used.candidate(layers), series, base.noises, start, units)
        for layers in ([layer(bench, LAG)], [layer(bench, LAG), layer(bench, FRICTION)])
    )
    first = Tried(layer(bench, LAG), 0.0, lag, evidence(lag, base, series))
    return used, [first, Tried(layer(bench, FRICTION), 0.0, both, evidence(both, lag, series))]


@pytest.mark.long
@pytest.mark.parametrize(("name", "goes_better"), [(DELAY, True), (OFFSET, False)])
def test_what_it_is_confused_with_is_tried_though_it_was_not_fitted(
    bench: Bench, late: tuple[Bench, list[Tried]], name: str, goes_better: bool
) -> None:
    """Alone it promised nothing; an effect that it is not confused with stays away."""
    used, accepted = late
    model = accepted[-1].estimate
    told: list[str] = []
    assert model is not None
    units = units_of(model.candidate, used.series, model.values(0))
    rivals = [accepted[0], Tried(layer(bench, name), -5.0)]
    kept, better = swapped(used, model, accepted, rivals, units, told.append)
    assert [one.layer.id for one in kept] == [name if goes_better else LAG, FRICTION]
    assert bool(told) is goes_better
    assert (better.cost < model.cost - 100.0) is goes_better
    before, after = accepted[0].evidence, kept[0].evidence
    assert before is not None
    assert after is not None
    assert (after.train > before.train + 100.0) is goes_better


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
    bench: Bench, late: tuple[Bench, list[Tried]], name: str, part: float, is_tried: bool
) -> None:
    """A delay gained four tenths of what a lag did, until what both hid was found."""
    used, accepted = late
    old, model = accepted[0], accepted[-1].estimate
    assert old.evidence is not None
    assert model is not None
    gained = Evidence(part * old.evidence.train, part * old.evidence.left_out, old.evidence.each)
    rival = Tried(layer(bench, name), 1.0, None, gained)
    units = units_of(model.candidate, used.series, model.values(0))
    kept, _ = swapped(used, model, accepted, [rival], units, lambda text: None)
    assert (kept[0].layer.id == name) is is_tried
