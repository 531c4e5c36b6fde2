"""What is missing is found where it is: sensors are not taken for torques, accepted places lead."""

from __future__ import annotations

import dataclasses
from fractions import Fraction

import pytest

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.data.stacked_recordings import burn_in_samples
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.levenberg_marquardt import estimate_parameters
from diagnosis.estimation.model_set import ModelSet
from diagnosis.localisation.cause import balance_of
from diagnosis.localisation.disturbance_state_fit import free_disturbance
from diagnosis.localisation.location import Location, location_of
from diagnosis.localisation.location_text import NO_LOCATION, format_location
from diagnosis.localisation.ranking import localise, rank_accepted_first, rank_causes_first
from diagnosis.model.placed_effect import PlacedEffect, disturbance_effect
from tests.diagnosis.estimation.test_levenberg_marquardt import (
    FRICTION,
    TRUTH,
    bench,
    ordinary_noise_levels,
    place_effect,
    simulate_recordings,
)

__all__ = ["bench"]


def with_effect(bench: ModelSet, effect: str, own: dict[str, float]) -> ModelSet:
    truth = bench.compile_candidate((place_effect(bench, effect),))
    series: tuple[SampledRecording, ...] = simulate_recordings(truth, {**TRUTH, **own})
    shown = dataclasses.replace(bench, effects=(), series=series, _compiled={})
    disturbances = tuple(
        dataclasses.replace(one, scales={"time": Fraction(1, 5)}) for one in bench.disturbances
    )
    return dataclasses.replace(shown, disturbances=disturbances)  # as in recordings of 10 s


def sensor_of(model_set: ModelSet) -> PlacedEffect:
    """The disturbance of the wheel sensor."""
    return model_set.scale_disturbance(disturbance_effect("output", "w_s"))


def fit_first_base(bench: ModelSet) -> Estimate:
    """The base fitted from its declared values, with the ordinary disturbance at each balance."""
    candidate = bench.compile_candidate(())
    noise_levels = ordinary_noise_levels(candidate, bench.series)
    return estimate_parameters(candidate, bench.series, noise_levels, {})


def test_a_sensor_is_not_taken_for_a_torque(bench: ModelSet) -> None:
    hidden = with_effect(bench, "sensor_lag@w_s", {"tau_w_s": 0.03})
    base = fit_first_base(hidden)
    sensor = free_disturbance(hidden, base, sensor_of(hidden))
    assert sensor.cost < free_disturbance(hidden, base, hidden.disturbances[0]).cost - 100.0


def test_the_places_are_ranked_by_what_a_free_disturbance_gains_there(bench: ModelSet) -> None:
    hidden = with_effect(bench, "coulomb_friction@w_em", FRICTION)
    base = fit_first_base(hidden)
    loci = localise(hidden, base)
    assert loci[0].path == "flow.w_em"
    gains = [one.gain for one in loci]
    assert gains == sorted(gains, reverse=True)
    free = free_disturbance(hidden, base, hidden.disturbances[0])
    assert loci[0].gain == free_disturbance(hidden, base).cost - free.cost
    assert [bool(one.disturbances) for one in loci] == [True] + [False] * (len(loci) - 1)


def test_a_friction_is_no_sensor_and_told_with_its_size_and_what_it_goes_with(
    bench: ModelSet,
) -> None:
    hidden = with_effect(bench, "coulomb_friction@w_em", FRICTION)
    base, layer = fit_first_base(hidden), hidden.disturbances[0]
    free = free_disturbance(hidden, base, layer)
    assert free.cost < free_disturbance(hidden, base, sensor_of(hidden)).cost - 100.0
    locus = location_of(hidden, "flow", layer, free)
    assert locus.rms == pytest.approx(FRICTION["T_c_w_em"], rel=0.4)
    burn_in = burn_in_samples(hidden.series[0]) * float(hidden.period)
    assert all(start >= burn_in for start, _, _ in locus.windows)
    told = format_location(rank_accepted_first([locus], ["flow.w_em"], hidden), hidden)
    assert told.startswith("missing in the balance of w_em: ")
    assert "N*m rms" in told
    assert "% of what accelerates it" in told
    assert f"along with {locus.correlates[0][0]} (r = " in told


def test_the_place_of_an_accepted_effect_leads_with_what_its_balance_shows(bench: ModelSet) -> None:
    loci = [Location("elements", "half_shaft", 90.0, 8.0), Location("flow", "w_em", 80.0, 2.0)]
    led = rank_accepted_first(loci, ["inputs.T_em"], bench)
    assert [one.path for one in led] == ["inputs.T_em", "elements.half_shaft", "flow.w_em"]
    assert (led[0].rms, led[0].gain, led[0].is_accepted) == (2.0, 80.0, True)
    assert balance_of(bench, "elements", "vehicle") == "flow.w_w"
    assert balance_of(bench, "elements", "half_shaft") == "elements.half_shaft"


def test_nothing_is_told_where_no_place_gains(bench: ModelSet) -> None:
    assert format_location([Location("flow", "w_em", -3.0, 0.1)], bench) == NO_LOCATION


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
    bench: ModelSet, feature: str, correlation: float, leads: str
) -> None:
    first = Location("flow", "w_em", 90.0, 2.0, correlates=((feature, correlation),))
    rest = Location("elements", "half_shaft", 10.0, 2.0)
    assert rank_causes_first((first, rest), (), bench)[0].path == leads
