"""Output error: a rotor that soon forgets its initial speed is simulated as a whole."""

from __future__ import annotations

import dataclasses
from fractions import Fraction

import numpy as np
import pytest

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.model_set import ModelSet, balance_disturbances
from diagnosis.model.placed_effect import shipped_effects
from diagnosis.selection.forward_selection import select_effects
from diagnosis.selection.intersample import FittedBase, fit_base
from diagnosis.selection.output_error import OutputErrorFit, fit_output_error, has_fading_memory
from tests.diagnosis.rotor_project import EFFECTS, FINE, RATE, B, J
from tests.diagnosis.selection.fake_fits import rotor_model_set
from tests.diagnosis.selection.test_intersample import spin

BRAKED, T_C = 5.0, 1.0
"""Viscous friction [N*m*s/rad] with which the speed decays in 0.1 s, and dry friction [N*m]."""
NOISE = 0.005


def braked(seed: int) -> SampledRecording:
    """A run of a rotor with much viscous friction, and with dry friction."""
    random = np.random.default_rng(seed)
    torque = np.repeat(random.uniform(-12.0, 12.0, 12), RATE // 2)
    w, h, seen = 0.0, 1.0 / (RATE * FINE), np.zeros(len(torque))
    for k, T in enumerate(torque):
        seen[k] = w
        for _ in range(FINE):
            w += h * (T - BRAKED * w - T_C * np.tanh(w / 0.1)) / J
    measured = seen + random.normal(0.0, NOISE, len(seen))
    name = f"run_{seed}"
    return SampledRecording(
        name, Fraction(1, RATE), Fraction(0), torque[:, None], measured[:, None]
    )


def rotor_of(series: tuple[SampledRecording, ...], friction: float) -> ModelSet:
    """The rotor with a viscous friction [N*m*s/rad] and a library of effects."""
    effects = [one for one in shipped_effects() if one.name in EFFECTS]
    blank = rotor_model_set(effects, f"{friction} N*m*s/rad, range: [0.01, 50]")
    drifts = balance_disturbances(blank.document, blank.automaton)
    return dataclasses.replace(blank, series=series, disturbances=drifts)


@pytest.fixture(scope="module")
def full_rate_set() -> ModelSet:
    return rotor_of((braked(1), braked(2)), friction=0.8 * BRAKED)


@pytest.fixture(scope="module")
def predicted(full_rate_set: ModelSet) -> FittedBase:
    return fit_base(full_rate_set)


@pytest.fixture(scope="module")
def simulated(full_rate_set: ModelSet, predicted: FittedBase) -> OutputErrorFit:
    return fit_output_error(full_rate_set, predicted[1])


def test_a_braked_rotor_forgets_its_initial_speed(predicted: FittedBase) -> None:
    model_set, base = predicted
    assert has_fading_memory(base, model_set.series)


def test_a_rotor_that_runs_on_does_not() -> None:
    model_set, base = fit_base(rotor_of((spin(is_linear=False, T_c=0.0),), friction=B))
    assert not has_fading_memory(base, model_set.series)


def test_the_base_is_simulated_without_disturbances(
    predicted: FittedBase, simulated: OutputErrorFit
) -> None:
    levels = simulated.base.noise_levels
    assert levels.is_output_error
    assert levels.process == {}
    assert np.all(np.isinf(levels.huber_limits))
    assert simulated.model_set.disturbances == ()
    assert simulated.base.candidate.disturbance_states == ()
    assert np.array_equal(levels.outputs, predicted[1].noise_levels.outputs)
    assert not simulated.model_set.series[0].is_first_order_hold  # as it was recorded


def test_the_missing_friction_is_found_in_simulations(simulated: OutputErrorFit) -> None:
    found = select_effects(simulated.model_set, simulated.base)
    assert found.accepted[0].placed_effect.id == "coulomb_friction@w"
    assert len(found.accepted) == 1
    assert found.first.free == {}
    assert found.model.noise_levels.is_output_error
    values = found.model.values(0)
    assert values["T_c_w"] == pytest.approx(T_C, rel=0.05)
    assert values["b"] == pytest.approx(BRAKED, rel=0.05)
