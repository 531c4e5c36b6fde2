"""Noise levels and gains of a set of recordings do not depend on their order and their units."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.innovations import measured_noise_levels, predict
from diagnosis.estimation.kalman_gain import kalman_gains
from diagnosis.estimation.noise_level import disturbance_units
from diagnosis.model.candidate import Candidate, compile_candidate
from diagnosis.model.placed_effect import disturbance_effect
from language.overlays.expand_document import Project, expand_document
from language.text.diagnostic import Source
from language.text.project_files import parse_document

SPEC = """\
language: 1
automaton: fan
about: a rotor with a drag that grows with the square of its speed
step: 5 ms
parameters:
  J: {value: 0.5 kg*m^2, range: [0.3, 0.8]}
  d: {value: 0.05 N*m*s^2, range: [0.01, 0.5]}
inputs: {T: {unit: N*m}}
states: {w: {unit: rad/s, initial: 0 rad/s}}
flow: {w: J * der(w) = T - d * w * abs(w)}
modes: {turning: {}}
outputs: [w]
"""


def recording(start: float, count: int) -> SampledRecording:
    """A recording at a constant speed [rad/s] with a little noise."""
    noise = np.random.default_rng(count).normal(0.0, 0.01, (count, 1))
    torque = np.full((count, 1), 0.05 * start * abs(start))
    return SampledRecording("a", Fraction(1, 200), Fraction(0), torque, start + noise)


@pytest.fixture(scope="module")
def fan() -> Candidate:
    document = parse_document(Source("fan.yaml", tuple(SPEC.splitlines())), SPEC)
    project = Project(Path())
    drift = disturbance_effect("balance", "w")
    expanded = expand_document(document, project)
    return compile_candidate(expanded, project, (), (drift,), ("w",), Fraction(1, 200))


def test_the_order_of_recordings_does_not_change_units_and_gains(fan: Candidate) -> None:
    """The drag at 40 rad/s damps a disturbance; the burn-in of a short recording is shorter."""
    series = [recording(0.0, 700), recording(40.0, 500), recording(10.0, 200)]
    units, gains, first = [], [], []
    start = kalman_gains(fan, series, {}, measured_noise_levels(series, {"drift_balance_w": 0.0}))
    for some in (series, series[::-1]):
        units.append(disturbance_units(fan, some, {}))
        levels = measured_noise_levels(some, units[-1])
        first.append(kalman_gains(fan, some, {}, levels))
        prediction = predict(fan, some, [{}] * len(some), start, levels.huber_limits)
        gains.append(kalman_gains(fan, some, {}, levels, prediction))
    alone = disturbance_units(fan, series[:1], {}), disturbance_units(fan, series[1:2], {})
    (name,) = units[0]
    assert alone[1][name] > 1.5 * alone[0][name]
    assert units[0] == units[1]
    for one, other in (first, gains):
        assert np.array_equal(one.transient, other.transient)
        assert np.array_equal(one.steady_state, other.steady_state)


@given(st.floats(1e-9, 1e9))
def test_the_unit_of_an_output_does_not_change_the_noise_of_another(factor: float) -> None:
    """Neither output has noise, so each has the least one."""
    line = np.linspace(1.0, 2.0, 400)
    rows = np.column_stack([line, factor * line])
    one = SampledRecording("a", Fraction(1, 200), Fraction(0), rows[:, :1], rows)
    outputs = measured_noise_levels([one], {}).outputs
    assert outputs[1] == pytest.approx(factor * outputs[0], rel=1e-6)
