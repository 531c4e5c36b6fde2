"""The solver: step size, the brief's equations, contacts that do not pull, energy that decays."""

from dataclasses import replace

import numpy as np
import pytest

from tests.generators.blind_cases.effect_catalogue import CATALOGUE
from tests.generators.blind_cases.effect_free_comparison import (
    case_of,
    clean_recordings,
    motion_of,
    rms_difference,
)
from tests.generators.blind_cases.physical_parameters import Physics, clean_physics
from tests.generators.blind_cases.solver import STEP_S, SUBSTEPS, Array, solve
from tests.generators.blind_cases.true_parameters import NOMINAL

LEAST_NOISE = (0.05, 0.01)
"""Smallest noise of motor and wheel speed that a case can have [rad/s]."""

PASSIVE = (
    "unequal_half_shafts", "second_gap", "position_dependent_stiffness", "mount_compliance",
    "added_inertia", "load_dependent_loss",
)  # fmt: skip
"""Effects whose stored energy the solver knows."""


def serial_of(kind: str) -> int:
    """Place of that manoeuvre in the training set."""
    return [recording.manoeuvre for recording in clean_recordings()].index(kind)


@pytest.mark.long
@pytest.mark.parametrize("names", [(), *((name,) for name in CATALOGUE)])
def test_half_the_step_changes_little(names: tuple[str, ...]) -> None:
    """Less than a twentieth of the smallest noise, through zero speed and through the gap."""
    serial = serial_of("launch")
    whole = motion_of(names, serial)
    half = motion_of(names, serial, substeps=2 * SUBSTEPS)
    assert rms_difference(whole.w_em, half.w_em, scaled=False) < LEAST_NOISE[0] / 20
    assert rms_difference(whole.w_w, half.w_w, scaled=False) < LEAST_NOISE[1] / 20


def plain_rates(p: Physics, y: list[float], torque: float) -> tuple[list[float], float]:
    """The brief's equations written down once more: w_em, w_w, twist, gap, filtered w_w."""
    w_em, w_w, twist, gap, read = y
    rate = w_em / p.ratio - w_w
    free = rate + p.k / p.c * (twist - gap)
    stuck = (gap >= p.alpha and free > 0.0) or (gap <= -p.alpha and free < 0.0)
    gap_rate = 0.0 if stuck else free
    shaft = p.k * (twist - gap) + p.c * (rate - gap_rate)
    load = p.f0 * float(np.tanh(w_w / 0.2)) + p.cd2 * w_w * abs(w_w) + p.b_w * w_w
    motor = (torque - shaft / p.ratio - p.b_em * w_em) / p.J_em
    return [motor, (shaft - load) / p.J_v, rate, gap_rate, (w_w - read) / p.tau_f], shaft


def plain_motion(p: Physics, speed: float, torque: Array, substeps: int) -> Array:
    """Euler steps of 1 ms / substeps; speeds of motor and wheel every 1 ms."""
    twist = p.alpha + p.ratio * (float(torque[0]) - p.b_em * p.ratio * speed) / p.k
    y = [p.ratio * speed, speed, twist, p.alpha, speed]
    out, step = [], STEP_S / substeps
    for row in range(len(torque)):
        out.append((y[0], y[4]))
        rise = float(torque[min(row + 1, len(torque) - 1)] - torque[row]) / substeps
        for part in range(substeps):
            rates, _ = plain_rates(p, y, float(torque[row]) + part * rise)
            y = [value + step * rate for value, rate in zip(y, rates, strict=True)]
            y[3] = min(max(y[3], -p.alpha), p.alpha)
    return np.array(out)


def test_against_the_brief_s_equations() -> None:
    """Plain Euler integration, extrapolated to no step, through the gap: the same motion."""
    physics = clean_physics(NOMINAL)
    time = np.arange(900) * STEP_S
    torque = 70.0 - 60.0 * (1.0 + np.tanh((time - 0.2) / 0.02)) + 50.0 * (time > 0.5)
    given = np.column_stack([torque, np.zeros((900, 3))])
    motion = solve(physics, 20.0, given)
    coarse, fine = (plain_motion(physics, 20.0, torque, substeps) for substeps in (25, 50))
    plain = 2.0 * fine - coarse
    assert np.count_nonzero(np.diff(motion.contact[:, 0])) >= 4
    assert rms_difference(motion.w_em, plain[:, 0], scaled=False) < LEAST_NOISE[0] / 20
    assert rms_difference(motion.w_w, plain[:, 1], scaled=False) < LEAST_NOISE[1] / 20


@pytest.mark.parametrize("names", [(), ("unequal_half_shafts",), ("second_gap",)])
def test_contacts_push_only(names: tuple[str, ...]) -> None:
    """In contact the torque is of the contact's side, in the gap there is none."""
    for kind in ("steps_low", "launch"):
        motion = motion_of(names, serial_of(kind))
        pushed = motion.torque * motion.contact
        assert pushed.min() > -1e-6
        assert np.all(motion.torque[motion.contact == 0.0] == 0.0)
        crossings = np.count_nonzero(np.diff(motion.contact[:, 0]))
        assert crossings >= 4


@pytest.mark.parametrize("names", [(), *((name,) for name in PASSIVE)])
def test_energy_decays(names: tuple[str, ...]) -> None:
    """Without outer friction, left alone after a load was dropped: no energy is gained."""
    quiet = {"f0": 0.0, "cd2": 0.0, "b_w": 0.0, "b_em": 0.0, "c": 5.0}
    physics = replace(case_of(names).physics, **quiet)
    given = np.zeros((4000, 4))
    given[:3, 0] = 120.0
    energy = solve(physics, 15.0, given).energy[5:]
    assert np.diff(energy).max() < 1e-8 * energy[0]
    assert energy[-1] < energy[0] - 1.0


def test_states_are_settled_at_the_start() -> None:
    """Torque in the shaft changes little over the first 20 ms of a steady start."""
    physics = clean_physics(NOMINAL)
    given = np.column_stack([np.full(20, 40.0), np.zeros((20, 3))])
    torque = solve(physics, 25.0, given).torque[:, 0]
    assert abs(torque[0] - 9.0 * (40.0 - 0.01 * 225.0)) < 2.0
