"""The step of a prediction follows the fastest dynamics; one period for rounded time stamps."""

from __future__ import annotations

import dataclasses
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from diagnosis.data.sampled_recording import (
    MAX_SHARED_SLIP,
    MAX_SLIP,
    SampledRecording,
    decimate,
    grid_period,
    interpolate,
    resample,
    sample_recording,
    share_period,
    simplest_fraction,
)
from diagnosis.data.time_resolution import SHORTEST_STEP, STEP_RATE_PRODUCT, time_resolution
from engine.recordings.recording import Channel, Recording
from language.loading.load import automaton_of
from language.model.automaton import Automaton
from language.overlays.expand_document import Project
from language.text.diagnostic import Source
from language.text.project_files import parse_document
from tests.diagnosis.rotor_project import SPEC
from tests.diagnosis.small_driveline import read_recording_map

LONGEST = Fraction(5, 1000)
TWO_MODES = """\
language: 1
automaton: heated
step: 1 ms
parameters: {fast: {value: 400 1/s}, slow: {value: 2 1/s}}
states: {x: {unit: rad, initial: 1 rad, range: [-9, 9]}}
initial: far
modes:
  far:
    flow: {x: der(x) = -slow * x}
    transitions: {near: {when: x < 0.5 rad}}
  near:
    flow: {x: der(x) = -fast * x}
outputs: [x]
"""

PARALLEL = """\
language: 1
automaton: parallel
step: 0.1 ms
parameters: {fast: {value: 400 1/s}, slow: {value: 2 1/s}}
states:
  x: {unit: rad, initial: 1 rad, range: [-9, 9]}
  z: {unit: rad, initial: 0 rad, range: [-9, 9]}
flow: {x: der(x) = -slow * x, z: der(z) = rate}
regions:
  gap:
    initial: shut
    modes:
      shut:
        equations: {rate: 0 rad/s}
        transitions: {open: {when: x < 0.5 rad}}
      open:
        equations: {rate: fast * (x - z)}
        transitions: {shut: {when: x > 0.6 rad}}
outputs: [x, z]
"""

TANK = """\
language: 1
automaton: tank
step: 0.1 s
parameters: {a: {value: 0.01 m/s}}
states: {h: {unit: m, initial: 1 m, range: [0, 2]}}
flow: {h: "der(h) = -a * sqrt(max(h, 0 m) / 1 m)"}
outputs: [h]
"""

COUNTER = """\
language: 1
automaton: counter
period: 1 ms
numbers: float64
states: {level: {initial: 0, range: [0, 9]}}
modes: {run: {update: {level: level / 2}}}
outputs: [level]
"""


def automaton(text: str, name: str) -> Automaton:
    return automaton_of(
        parse_document(Source(name, tuple(text.splitlines())), text), Project(Path())
    )


def rotor(friction: str) -> Automaton:
    """The rotor with a rate of b / J = 2 b [1/s]."""
    text = SPEC.replace("recording_map: bench_columns\n", "")
    text = text.replace("0.1 N*m*s/rad, range: [0.01, 0.5]", f"{friction} N*m*s/rad")
    return automaton(text, "spinner.yaml")


def test_the_step_is_half_the_time_constant_of_the_fastest_component() -> None:
    assert time_resolution(rotor("100"), LONGEST) == STEP_RATE_PRODUCT / 200
    assert time_resolution(automaton(TWO_MODES, "heated.yaml"), LONGEST) == STEP_RATE_PRODUCT / 400


def test_a_mode_of_a_parallel_region_counts_as_well() -> None:
    found = time_resolution(automaton(PARALLEL, "parallel.yaml"), LONGEST)
    assert found == STEP_RATE_PRODUCT / 400


def test_the_infinite_slope_of_a_square_root_at_rest_does_not_count() -> None:
    assert time_resolution(automaton(TANK, "tank.yaml"), LONGEST) == LONGEST


def test_the_step_of_a_slow_model_is_the_longest_one() -> None:
    assert time_resolution(rotor("0.1"), LONGEST) == LONGEST


def test_the_step_of_a_very_fast_model_is_not_shorter_than_the_shortest() -> None:
    assert time_resolution(rotor("1.0e9"), LONGEST) == SHORTEST_STEP


def stamps(period: Fraction, count: int, decimals: int) -> list[Fraction]:
    """Time stamps of a uniform grid, as a file with so many decimals has them."""
    scale = 10**decimals
    return [Fraction(round(k * period * scale), scale) for k in range(count)]


@pytest.mark.parametrize(
    ("period", "decimals"),
    [
        (Fraction(1, 3), 2),
        (Fraction(1, 3), 6),
        (Fraction(1, 400), 4),
        (Fraction(1, 1024), 6),
        (Fraction(1, 60), 3),
        (Fraction(5, 1000), 3),
    ],
)
def test_the_period_is_exact_although_stamps_are_rounded(period: Fraction, decimals: int) -> None:
    assert grid_period(stamps(period, 3000, decimals)) == period


def test_the_period_is_exact_with_gaps_and_jitter() -> None:
    times = stamps(Fraction(1, 100), 2000, 4)
    assert grid_period(times[:500] + times[900:1300] + times[1301:]) == Fraction(1, 100)
    random = np.random.default_rng(3)
    moved = [
        time + Fraction(int(random.integers(-2000, 2000)), 10**6) if 0 < k < 1999 else time
        for k, time in enumerate(times)
    ]
    assert grid_period(moved) == Fraction(1, 100)


@pytest.mark.parametrize("count", [2, 3, 10, 1000])
def test_uniform_stamps_have_their_exact_period(count: int) -> None:
    """However few they are."""
    for period in (Fraction(1, 2), Fraction(1, 1000), Fraction(977, 10**6)):
        assert grid_period([1 + k * period for k in range(count)]) == period


def test_the_last_sample_counts_although_stamps_are_rounded() -> None:
    columns = read_recording_map().columns
    for count in (3, 50, 3000):
        times = tuple(stamps(Fraction(1, 3), count, 2))
        values = tuple(float(k) for k in range(count))
        channels = {key: Channel(columns[key], times, values) for key in ("torque", "motor")}
        whole = Recording("a", channels, times[-1], times[0])
        one = sample_recording(whole, ["T_em"], ["w_em"], {})
        assert one.measured[:, 0].tolist() == one.inputs[:, 0].tolist() == list(values)


@given(st.fractions(Fraction(1, 2000), Fraction(2), max_denominator=2000), st.integers(2, 400))
def test_the_last_stamp_stays_within_the_slip(period: Fraction, count: int) -> None:
    found = grid_period([k * period for k in range(count + 1)])
    assert abs(found - period) * count <= MAX_SLIP * period
    assert found.denominator <= period.denominator


@given(
    st.fractions(Fraction(1, 1000), Fraction(9), max_denominator=1000),
    st.fractions(Fraction(0), Fraction(1), max_denominator=1000),
)
def test_the_simplest_fraction_is_in_its_interval_with_the_least_denominator(
    low: Fraction, width: Fraction
) -> None:
    high = low + width
    found = simplest_fraction(low, high)
    assert low <= found <= high
    for denominator in range(1, found.denominator):
        assert -(-low * denominator // 1) > high * denominator // 1  # no integer is between


def recording(name: str, period: Fraction, count: int) -> SampledRecording:
    columns = np.zeros((count, 1))
    return SampledRecording(name, period, Fraction(0), columns, columns)


def test_recordings_whose_stamps_are_rounded_share_the_period_of_the_longest() -> None:
    exact, rounded = Fraction(1, 400), Fraction(100_001, 40_000_000)
    shared = share_period([recording("a", rounded, 500), recording("b", exact, 4000)])
    assert [one.period for one in shared] == [exact, exact]


def test_a_recording_whose_last_sample_would_move_is_interpolated() -> None:
    period, count = Fraction(1, 100), 1000
    for slip, is_kept in ((MAX_SHARED_SLIP, True), (MAX_SHARED_SLIP * 2, False)):
        one = recording("a", period * (1 + slip / count), count)
        (shared,) = share_period([one], period)
        assert shared.period == period
        assert (shared.measured is one.measured) is is_kept


def test_recordings_at_unlike_rates_get_the_longest_period_and_linear_signals() -> None:
    fast = recording("fast", Fraction(1, 200), 1801)
    ramp = np.arange(1801.0)[:, np.newaxis]
    fast = dataclasses.replace(fast, inputs=ramp, measured=2.0 * ramp)
    slow = recording("slow", Fraction(1, 77), 500)
    found = share_period([fast, slow])
    assert [one.period for one in found] == [Fraction(1, 77)] * 2
    assert found[0].count == 1 + int(Fraction(1800, 200) * 77)
    times = np.arange(found[0].count) / 77.0
    np.testing.assert_allclose(found[0].inputs[:, 0], 200.0 * times, rtol=1e-12)
    np.testing.assert_allclose(found[0].measured[:, 0], 400.0 * times, rtol=1e-12)


def test_an_unknown_value_makes_its_neighbours_unknown_and_a_hit_sample_is_kept() -> None:
    one = recording("a", Fraction(1, 100), 5)
    one.measured[2] = np.nan
    halves = interpolate(one, Fraction(1, 200))
    assert np.flatnonzero(np.isnan(halves.measured[:, 0])).tolist() == [3, 4, 5]
    same = interpolate(one, Fraction(1, 50))
    assert np.flatnonzero(np.isnan(same.measured[:, 0])).tolist() == [1]


def test_a_fast_model_keeps_the_samples_that_a_slow_one_does_not_need() -> None:
    series = recording("a", Fraction(1, 1000), 1000)
    for model, period in ((rotor("0.1"), LONGEST), (rotor("100"), Fraction(2, 1000))):
        assert decimate(series, longest=time_resolution(model, LONGEST)).period == period


def test_inputs_are_averaged_over_a_quarter_of_the_fastest_time_constant() -> None:
    """The mean of a sine of 100 rad/s over 2.5 ms is 0.3 % too small."""
    series = recording("a", Fraction(1, 2000), 20_000)
    (thin,) = resample([series], rotor("50"), ("w",), False)
    assert thin.period == Fraction(25, 10_000)
    (slow,) = resample([series], rotor("5"), ("w",), False)
    assert slow.period == Fraction(5, 1000)


def test_the_step_of_a_sampled_automaton_is_the_longest_one() -> None:
    assert time_resolution(automaton(COUNTER, "counter.yaml"), LONGEST) == LONGEST
