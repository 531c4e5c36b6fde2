"""Manoeuvres: what the driver asks of motor and brake in one recording."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SETTLING = 1.0
"""Time before the recording, with its first torque held, in which transients die out [s]."""
SHORTEST, LONGEST = 8.6, 9.5
"""Length of a recording [s]: six of the shortest make 50 s, four make 30 s."""


@dataclass(frozen=True)
class Manoeuvre:
    """Torques over time as corners (times [s], values [N*m]), a sweep, the first speed."""

    kind: str
    duration: float
    wheel_speed: float
    """Wheel speed before the recording [rad/s]."""
    torque: tuple[Sequence[float], Sequence[float]]
    brake: tuple[Sequence[float], Sequence[float]] = ((0.0,), (0.0,))
    sweep: tuple[float, float, float] = (0.0, 1.0, 1.0)
    """Amplitude [N*m], first and last frequency [Hz] of a logarithmic sweep on the torque."""

    def torques(self, time: Floats) -> Floats:
        """Return the demanded motor torque [N*m] at the times [s], (n_times,)."""
        amplitude, first, last = self.sweep
        rate = np.log(last / first) / self.duration if last > first else 1.0
        passed = np.clip(time, 0.0, None)
        phase = 2.0 * np.pi * first / rate * np.expm1(rate * passed)
        return np.asarray(np.interp(time, *self.torque) + amplitude * np.sin(phase))

    def brakes(self, time: Floats) -> Floats:
        """Return the brake torque at the wheel [N*m] at the times [s], (n_times,)."""
        return np.asarray(np.interp(time, *self.brake))


Corners = tuple[list[float], list[float]]


def staircase(
    generator: np.random.Generator, duration: float, levels: Sequence[float], rise: float
) -> Corners:
    """Go through the levels [N*m], each kept for a share of the duration, `rise` [s] between."""
    shares = generator.uniform(0.6, 1.4, len(levels))
    ends = np.cumsum(shares / shares.sum()) * duration
    times, values = [0.0], [float(levels[0])]
    for end, before, after in zip(ends.tolist(), levels, levels[1:], strict=False):
        slope = rise * generator.uniform(0.7, 1.5)
        times += [end, end + slope]
        values += [float(before), float(after)]
    return times, values


def sweep(generator: np.random.Generator, duration: float) -> Manoeuvre:
    """Excite the shaft from 0.5 to 15 Hz around a load that holds the gap closed."""
    load, amplitude = generator.uniform(25.0, 60.0), generator.uniform(10.0, 20.0)
    corners = ([0.0, duration], [load, load * generator.uniform(0.5, 1.0)])
    speed = generator.uniform(12.0, 30.0)
    return Manoeuvre(
        "sweep", duration, speed, corners, sweep=(amplitude, 0.5, generator.uniform(13.0, 15.0))
    )


def tips(generator: np.random.Generator, duration: float) -> Manoeuvre:
    """Tip in and out by several sizes, through the gap."""
    sizes = generator.permutation([20.0, 50.0, 90.0, 140.0]) * generator.uniform(0.85, 1.1, 4)
    backs = generator.uniform(-40.0, 5.0, 4)
    levels = [5.0, *(level for pair in zip(sizes, backs, strict=True) for level in pair)]
    corners = staircase(generator, duration, levels, 0.06)
    return Manoeuvre("tips", duration, generator.uniform(10.0, 35.0), corners)


def shunting(generator: np.random.Generator, duration: float) -> Manoeuvre:
    """Roll backwards, launch through zero speed, back through it, and forth again."""
    forth, back, again = generator.uniform(55, 90), generator.uniform(45, 75), 80.0
    levels = [0.0, forth, 0.0, -back, -0.3 * back, again, 0.4 * again]
    corners = staircase(generator, duration, levels, 0.10)
    return Manoeuvre("shunting", duration, -generator.uniform(2.0, 5.0), corners)


def recuperation(generator: np.random.Generator, duration: float) -> Manoeuvre:
    """Drive and recuperate at high speed, up to full power."""
    weak, strong = generator.uniform(20.0, 45.0), generator.uniform(70.0, 110.0)
    full = generator.uniform(120.0, 150.0)
    levels = [15.0, -weak, 0.7 * full, -strong, full, -0.6 * strong, 30.0]
    corners = staircase(generator, duration, levels, 0.08)
    return Manoeuvre("recuperation", duration, generator.uniform(45.0, 65.0), corners)


def braking(generator: np.random.Generator, duration: float) -> Manoeuvre:
    """Coast, brake, coast again, tip in a little, brake lightly, coast."""
    first, second = generator.uniform(400.0, 800.0), generator.uniform(150.0, 350.0)
    starts = np.array([0.14, 0.62]) * duration + generator.uniform(-0.2, 0.2, 2)
    times, values = [0.0], [0.0]
    for start, torque in zip(starts.tolist(), (first, second), strict=True):
        times += [start, start + 0.25, start + 1.2, start + 1.4]
        values += [0.0, torque, torque, 0.0]
    tip = generator.uniform(15.0, 40.0)
    corners = (
        [0.0, 0.6, 0.7, 0.44 * duration, 0.44 * duration + 0.1, 0.56 * duration, 0.58 * duration],
        [15.0, 15.0, 0.0, 0.0, tip, tip, 0.0],
    )
    speed = generator.uniform(32.0, 48.0)
    return Manoeuvre("braking", duration, speed, corners, (times, values))


def reversals(generator: np.random.Generator, duration: float) -> Manoeuvre:
    """Cruise slowly with small reversals of the torque, each of them through the gap."""
    count = int(generator.integers(9, 15))
    sizes = generator.uniform(6.0, 22.0, count) * np.where(np.arange(count) % 2, -0.7, 1.0)
    corners = staircase(generator, duration, sizes.tolist(), 0.12)
    return Manoeuvre("reversals", duration, generator.uniform(6.0, 18.0), corners)


def ramps(generator: np.random.Generator, duration: float) -> Manoeuvre:
    """Slow ramps of the torque up, down through zero, and up."""
    top, bottom = generator.uniform(70.0, 120.0), generator.uniform(-70.0, -40.0)
    corners = ([0.0, 0.3 * duration, 0.75 * duration, duration], [0.0, top, bottom, 0.5 * top])
    return Manoeuvre("ramps", duration, generator.uniform(18.0, 40.0), corners)


def departure(generator: np.random.Generator, duration: float) -> Manoeuvre:
    """Depart from standstill, first gently, then firmly; brake until nearly standing."""
    creep, firm = generator.uniform(12.0, 25.0), generator.uniform(80.0, 140.0)
    corners = (
        [0.0, 0.5, 0.9, 2.4, 2.5, 0.55 * duration, 0.56 * duration, 0.70 * duration],
        [0.0, 0.0, creep, creep, firm, firm, 0.0, -10.0],
    )
    start, stop = 0.62 * duration, duration - 0.6
    torque = generator.uniform(350.0, 600.0)
    brake = ([start, start + 0.3, stop, stop + 0.2], [0.0, torque, torque, 0.0])
    return Manoeuvre("departure", duration, 0.0, corners, brake)


Plan = Callable[[np.random.Generator, float], Manoeuvre]

TRAIN: tuple[Plan, ...] = (sweep, tips, shunting, recuperation, braking, reversals)
HELD_OUT: tuple[Plan, ...] = (ramps, tips, departure, recuperation)


def manoeuvres(generator: np.random.Generator, plans: Sequence[Plan]) -> list[Manoeuvre]:
    """Return one manoeuvre of each plan in random order."""
    order = generator.permutation(len(plans)).tolist()
    return [
        plans[number](generator, round(generator.uniform(SHORTEST, LONGEST), 1)) for number in order
    ]
