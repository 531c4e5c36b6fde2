"""What is missing is found where it is: sensors are not taken for torques, accepted places lead."""

from __future__ import annotations

import dataclasses

import pytest

from diagnosis.actor import acting
from diagnosis.bench import Bench
from diagnosis.estimate import Estimate
from diagnosis.evidence import inflation
from diagnosis.freedom import freed
from diagnosis.joined import BURN_IN
from diagnosis.layers import drift, fitting
from diagnosis.level import first_fit, recalibrated, units_of
from diagnosis.location import DISTURBED, led_by, likely, located, unexplained
from diagnosis.locus import Locus, locus_of
from diagnosis.place_sentence import NOTHING, place_sentence
from diagnosis.series import Series
from tests.diagnosis.test_estimation import FRICTION, TRUTH, bench, recorded

__all__ = ["bench"]


def with_effect(bench: Bench, effect: str, own: dict[str, float]) -> Bench:
    layers = {layer.id: layer for e in bench.effects for layer in fitting(bench.document, e)}
    truth = bench.candidate((layers[effect],))
    series: tuple[Series, ...] = recorded(truth, {**TRUTH, **own})
    return Bench(
        bench.document, bench.project, bench.automaton, (), series, bench.seen, bench.drifts
    )


def based(bench: Bench) -> Estimate:
    candidate = bench.candidate(())
    units = units_of(candidate, bench.series, {})
    return recalibrated(first_fit(candidate, bench.series, units), bench.series, units)


def test_a_sensor_is_not_taken_for_a_torque(bench: Bench) -> None:
    hidden = with_effect(bench, "sensor_lag@w_s", {"tau_w_s": 0.03})
    base = based(hidden)
    sensor = freed(hidden, base, drift("output", "w_s"))
    assert sensor.cost < freed(hidden, base, hidden.drifts[0]).cost - 100.0


def test_what_small_drifts_of_the_base_take_up_is_hardly_unknown(bench: Bench) -> None:
    hidden = with_effect(bench, "coulomb_friction@w_em", FRICTION)
    base = based(hidden)
    loci, quiet = located(hidden, base), freed(hidden, base).cost
    gain = loci[0].gain / inflation(base, hidden.series)
    without = dataclasses.replace(base, cost=quiet)
    assert unexplained(hidden, without, loci) == pytest.approx(gain)
    as_good = dataclasses.replace(base, cost=quiet - loci[0].gain)
    assert unexplained(hidden, as_good, loci) == pytest.approx(DISTURBED * gain)


def test_a_friction_is_no_sensor_and_told_with_its_size_and_what_it_goes_with(
    bench: Bench,
) -> None:
    hidden = with_effect(bench, "coulomb_friction@w_em", FRICTION)
    base, layer = based(hidden), hidden.drifts[0]
    free = freed(hidden, base, layer)
    assert free.cost < freed(hidden, base, drift("output", "w_s")).cost - 100.0
    locus = locus_of(hidden, "flow", layer, free)
    assert locus.rms == pytest.approx(FRICTION["T_c_w_em"], rel=0.4)
    assert all(start >= BURN_IN for start, _, _ in locus.windows)
    told = place_sentence(led_by([locus], ["flow.w_em"], hidden), hidden)
    assert told.startswith("missing in the balance of w_em: ")
    assert "N*m rms" in told
    assert "% of what accelerates it" in told
    assert f"along with {locus.along[0][0]} (r = " in told


def test_the_place_of_an_accepted_effect_leads_with_what_its_balance_shows(bench: Bench) -> None:
    loci = [Locus("elements", "half_shaft", 90.0, 8.0), Locus("flow", "w_em", 80.0, 2.0)]
    led = led_by(loci, ["inputs.T_em"], bench)
    assert [one.path for one in led] == ["inputs.T_em", "elements.half_shaft", "flow.w_em"]
    assert (led[0].rms, led[0].gain, led[0].named) == (2.0, 80.0, True)
    assert acting(bench, "elements", "vehicle") == "flow.w_w"
    assert acting(bench, "elements", "half_shaft") == "elements.half_shaft"


def test_nothing_is_told_where_no_place_gains(bench: Bench) -> None:
    assert place_sentence([Locus("flow", "w_em", -3.0, 0.1)], bench) == NOTHING


@pytest.mark.parametrize(
    ("feature", "correlation", "leads"),
    [
        ("order 2 of the angle of w_em", 0.8, "inputs.T_em"),
        ("order 2 of the angle of w_em", 0.4, "flow.w_em"),
        ("order 2 of the angle of w_w", 0.8, "flow.w_em"),
        ("the sign of w_em", 0.8, "flow.w_em"),
    ],
)
def test_what_ripples_with_an_angle_is_led_by_the_input_there(
    bench: Bench, feature: str, correlation: float, leads: str
) -> None:
    first = Locus("flow", "w_em", 90.0, 2.0, along=((feature, correlation),))
    rest = Locus("elements", "half_shaft", 10.0, 2.0)
    assert likely((first, rest), (), bench)[0].path == leads
