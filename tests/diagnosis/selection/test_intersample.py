"""Inter-sample behaviour: that of the recordings is chosen by a base that lacks friction."""

from __future__ import annotations

import dataclasses
from fractions import Fraction

import numpy as np
import pytest

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet, balance_disturbances
from diagnosis.estimation.noise_level import HUBER_STDS, ORDINARY_LEVEL, disturbance_units
from diagnosis.selection.intersample import fit_base
from tests.diagnosis.rotor_project import FINE, RATE, T_C, B, J
from tests.diagnosis.selection.fake_fits import rotor_model_set

COUNT = 600
NOISE = 0.01
"""Noise of the speed [rad/s]."""


def spin(is_linear: bool, T_c: float = T_C, seed: int = 5) -> SampledRecording:
    """A run of the rotor with a torque that is linear between samples, or constant."""
    random = np.random.default_rng(seed)
    time = np.arange(COUNT + 1) / RATE
    tones = [(9.0, 0.4), (6.0, 1.3), (4.0, 3.1)]
    T = np.zeros(COUNT + 1)
    for size, frequency in tones:
        T += size * np.sin(2 * np.pi * frequency * time + random.uniform(0.0, 6.0))
    w, h, seen = 0.0, 1.0 / (RATE * FINE), np.zeros(COUNT)
    for k in range(COUNT):
        seen[k] = w
        for i in range(FINE):
            part = (i + 0.5) / FINE if is_linear else 0.0
            torque = T[k] + part * (T[k + 1] - T[k])
            w += h * (torque - B * w - T_c * np.tanh(w / 0.1)) / J
    measured = seen + random.normal(0.0, NOISE, COUNT)
    name = f"run_{seed}"
    return SampledRecording(
        name, Fraction(1, RATE), Fraction(0), T[:COUNT, None], measured[:, None]
    )


def rotor_of(*series: SampledRecording) -> ModelSet:
    """The rotor without dry friction, with a disturbance of its balance."""
    blank = rotor_model_set()
    drifts = balance_disturbances(blank.document, blank.automaton)
    return dataclasses.replace(blank, series=series, disturbances=drifts)


@pytest.fixture(scope="module")
def fitted() -> tuple[ModelSet, Estimate]:
    """The rotor with linear inputs, and its base, which lacks the friction."""
    return fit_base(rotor_of(spin(is_linear=True), spin(is_linear=True, seed=6)))


def test_linear_inputs_are_found_although_the_base_lacks_friction(
    fitted: tuple[ModelSet, Estimate],
) -> None:
    model_set, base = fitted
    assert all(one.is_first_order_hold for one in model_set.series)
    assert base.candidate.placed_effects == ()
    assert base.normal_equations is not None


def test_held_inputs_are_found_although_the_base_lacks_friction() -> None:
    lines: list[str] = []
    model_set, _ = fit_base(rotor_of(spin(is_linear=False)), lines.append)
    assert not any(one.is_first_order_hold for one in model_set.series)
    assert len(lines) == 1
    assert lines[0].startswith("base fitted, inputs held: ")


@pytest.mark.parametrize("is_linear", [False, True])
def test_the_base_that_lacks_nothing_finds_its_parameters(is_linear: bool) -> None:
    model_set, base = fit_base(rotor_of(spin(is_linear, T_c=0.0)))
    assert model_set.series[0].is_first_order_hold is is_linear
    found = base.values(0)
    assert found["J"] == pytest.approx(J, rel=0.02)
    assert found["b"] == pytest.approx(B, rel=0.05)


def test_noise_is_measured_and_the_ordinary_disturbance_is_held(
    fitted: tuple[ModelSet, Estimate],
) -> None:
    model_set, base = fitted
    levels = base.noise_levels
    assert levels.outputs[0] == pytest.approx(NOISE, rel=0.3)
    units = disturbance_units(base.candidate, model_set.series, {})
    assert levels.process == {name: ORDINARY_LEVEL * unit for name, unit in units.items()}
    assert np.all(np.isfinite(levels.huber_limits))
    assert levels.huber_limits[0] > HUBER_STDS * NOISE
