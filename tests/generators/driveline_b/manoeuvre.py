"""Manoeuvres: the torques that are demanded, and the disturbances that no one measures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.signal import lfilter

from tests.generators.driveline_b.solver import RATE_HZ, Reals

TRAIN = ("tip", "launch", "random_steps", "sweep", "coast", "power")
HELD_OUT = ("random_steps", "power", "tip", "launch")
BRAKE_RATE = 3000.0
"""Largest rate of the brake torque [N*m/s]."""


@dataclass(frozen=True)
class Manoeuvre:
    """Demanded torque and brake torque [N*m] (rows,), `RATE_HZ` of them per second, and the speed
    of the wheel at the start [rad/s].
    """

    kind: str
    torque: Reals
    brake: Reals
    speed: float


def draw_manoeuvre(kind: str, rng: np.random.Generator) -> Manoeuvre:
    """Return a manoeuvre of 8 to 9.5 s of one of the kinds of `TRAIN` and `HELD_OUT`."""
    count = int(rng.uniform(8.0, 9.5) * RATE_HZ) + 1
    rate = rng.uniform(300.0, 1500.0)
    brake = np.zeros(count)
    if kind == "sweep":
        torque, speed = _sweep(count, rng), rng.uniform(15.0, 35.0)
        return Manoeuvre(kind, torque, brake, speed)
    if kind == "random_steps":
        torque, speed = _random_steps(count, rng), rng.uniform(25.0, 45.0)
    else:
        ends, levels, speeds = STEPS[kind]
        torque, speed = _steps(count, ends, levels, rng), rng.uniform(*speeds)
    if kind == "coast":
        brake = _steps(count, [(2.0, 2.5), (3.6, 4.2)], [(0, 0), (200, 500), (0, 0)], rng)
    return Manoeuvre(kind, _limit_rate(torque, rate), _limit_rate(brake, BRAKE_RATE), speed)


Ranges = Sequence[tuple[float, float]]
STEPS: dict[str, tuple[Ranges, Ranges, tuple[float, float]]] = {
    "tip": (
        [(0.8, 1.2), (2.6, 3.1), (4.2, 4.7), (6.0, 6.6), (7.6, 8.2)],
        [(-15, -5), (40, 80), (-25, -8), (50, 110), (-20, -5), (20, 50)],
        (18, 35),
    ),
    "launch": (
        [(0.8, 1.2), (2.5, 3.0), (4.5, 5.0), (6.4, 7.0)],
        [(-14, -8), (15, 30), (-25, -15), (30, 60), (0, 10)],
        (-4, 2),
    ),
    "coast": (
        [(0.8, 1.2), (5.0, 5.5), (7.0, 7.6)],
        [(10, 20), (-12, -3), (30, 60), (-10, 0)],
        (35, 60),
    ),
    "power": (
        [(0.8, 1.2), (3.0, 3.6), (4.4, 5.0), (6.8, 7.4)],
        [(0, 15), (110, 150), (-40, -20), (110, 150), (10, 20)],
        (40, 60),
    ),
}
"""Times of the steps [s], levels between them [N*m] and first speeds of the wheel [rad/s]."""


def _steps(count: int, ends: Ranges, levels: Ranges, rng: np.random.Generator) -> Reals:
    """Return levels that change at times, both drawn from ranges (rows,)."""
    first, *others = (rng.uniform(*level) for level in levels)
    values = np.full(count, first)
    for end, level in zip(ends, others, strict=True):
        values[int(rng.uniform(*end) * RATE_HZ) :] = level
    return values


def _random_steps(count: int, rng: np.random.Generator) -> Reals:
    """Return levels of -40 to 90 N*m that change every 0.25 to 1 s (rows,)."""
    values = np.full(count, rng.uniform(-20.0, 30.0))
    time = 0.5
    while time * RATE_HZ < count:
        values[int(time * RATE_HZ) :] = rng.uniform(-40.0, 90.0)
        time += rng.uniform(0.25, 1.0)
    return values


def _sweep(count: int, rng: np.random.Generator) -> Reals:
    """Return a sine from 1 Hz to 14 to 22 Hz around a mean torque (rows,)."""
    time = np.arange(count) / RATE_HZ
    last, duration = rng.uniform(14.0, 22.0), count / RATE_HZ
    phase = 2.0 * np.pi * (time + (last - 1.0) / (2.0 * duration) * time**2)
    return np.asarray(rng.uniform(22.0, 35.0) + rng.uniform(15.0, 30.0) * np.sin(phase))


def _limit_rate(values: Reals, rate: float) -> Reals:
    """Return piecewise constant values (rows,) that change by at most `rate` per second."""
    change = rate / RATE_HZ
    limited = values.copy()
    level, edges = values[0], [*(np.flatnonzero(np.diff(values)) + 1), len(values)]
    for start, end in pairwise(edges):
        ramp = level + np.sign(values[start] - level) * change * np.arange(1, end - start + 1)
        low, high = sorted((level, values[start]))
        limited[start:end] = np.clip(ramp, low, high)
        level = limited[end - 1]
    return limited


def draw_disturbance(
    count: int, time_constant: float, std: float, rng: np.random.Generator
) -> Reals:
    """Return an Ornstein-Uhlenbeck process [N*m] (rows,) of a time constant [s] and a standard
    deviation, exact at the rows (Gillespie 1996).
    """
    decay = np.exp(-1.0 / (RATE_HZ * time_constant))
    noise = std * np.sqrt(1.0 - decay**2) * rng.standard_normal(count)
    noise[0] = std * rng.standard_normal()
    return np.asarray(lfilter([1.0], [1.0, -decay], noise), dtype=np.float64)
