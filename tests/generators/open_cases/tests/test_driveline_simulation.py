from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.generators.open_cases.driveline import NOMINAL, Driveline, columns_of
from tests.generators.open_cases.driveline_simulation import (
    STEP,
    Demand,
    Floats,
    Motion,
    integrate_motion,
)

TORQUE = 12.0
WITHOUT_LOSSES = replace(NOMINAL, b_em=0.0, b_w=0.0, f0=0.0, cd2=0.0)


def constant(
    driveline: Driveline, seconds: float, speed: float = 0.0, brake: float = 0.0
) -> tuple[Floats, Motion]:
    """Run one driveline under constant torque; return the times and the motion."""
    n_steps = round(seconds / STEP)
    ones = np.ones((n_steps, 1))
    demand = Demand(TORQUE * ones, brake * ones, 0.0 * ones)
    motion = integrate_motion(columns_of([driveline]), demand, (np.array([speed]), np.zeros(1)), ())
    return np.asarray(np.arange(n_steps + 1) * STEP), motion


def test_the_motor_alone_accelerates_until_the_gap_is_crossed() -> None:
    time, motion = constant(WITHOUT_LOSSES, 0.08)
    acceleration = TORQUE / NOMINAL.J_em
    contact = np.sqrt(2.0 * NOMINAL.alpha * NOMINAL.R / acceleration)
    free = time < contact - STEP
    assert motion.w_em[free, 0] == pytest.approx(acceleration * time[free], abs=1e-9)
    assert np.all(np.abs(motion.w_w[free]) < 1e-12)
    assert motion.w_w[time > contact + 3 * STEP, 0].min() > 0.0


def test_the_impulse_of_the_motor_is_in_the_two_inertias() -> None:
    time, motion = constant(WITHOUT_LOSSES, 0.5)
    momentum = NOMINAL.R * NOMINAL.J_em * motion.w_em + NOMINAL.J_v * motion.w_w
    assert momentum[:, 0] == pytest.approx(NOMINAL.R * TORQUE * time, abs=1e-9)


def test_the_shaft_rings_at_its_frequency_and_decays_with_its_damping() -> None:
    time, motion = constant(replace(WITHOUT_LOSSES, alpha=0.0), 0.6)
    share = 1.0 / NOMINAL.J_v + 1.0 / (NOMINAL.J_em * NOMINAL.R**2)
    decay = 0.5 * NOMINAL.c * share
    turning = np.sqrt(NOMINAL.k * share - decay**2)
    step = TORQUE / (NOMINAL.J_em * NOMINAL.R) / turning
    expected = step * np.exp(-decay * time) * np.sin(turning * time)
    relative = motion.w_em[:, 0] / NOMINAL.R - motion.w_w[:, 0]
    assert relative == pytest.approx(expected, abs=1e-3 * step)


def test_a_settled_vehicle_accelerates_by_what_friction_and_road_leave() -> None:
    _, motion = constant(NOMINAL, 2.0, speed=30.0)
    w = motion.w_w[-1, 0]
    resistance = NOMINAL.f0 + (NOMINAL.b_w + NOMINAL.b_em * NOMINAL.R**2 + NOMINAL.cd2 * w) * w
    inertia = NOMINAL.J_v + NOMINAL.J_em * NOMINAL.R**2
    last = (motion.w_w[-1, 0] - motion.w_w[-41, 0]) / (40 * STEP)
    assert last == pytest.approx((NOMINAL.R * TORQUE - resistance) / inertia, abs=2e-4)


def test_the_brake_stops_the_vehicle_and_holds_it() -> None:
    _, motion = constant(NOMINAL, 3.0, speed=-3.0, brake=400.0)
    assert motion.w_w[0, 0] == -3.0
    assert np.abs(motion.w_w[-400:, 0]).max() < 0.1
