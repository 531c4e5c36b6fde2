"""A driver on a rigid vehicle: writes down demanded torque and brake torque over time.

The driver knows the case's true base values but none of the effects, so that the manoeuvres of
a case and of its clean twin are the same.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from tests.generators.blind_cases.solver import STEP_S, Array
from tests.generators.blind_cases.true_parameters import RATIO, Base

TICK_S = 0.005
"""Distance of the driver's decisions [s]."""
LEAST_TORQUE, LARGEST_TORQUE = -120.0, 250.0
"""Of the demand [N*m]."""
LARGEST_POWER = 110e3
"""Of the demand [W]."""
FASTEST, FASTEST_BACK = 86.0, -12.0
"""Wheel speeds at which the driver gives way [rad/s]."""
SWEEP_CORNER_HZ = 8.0
"""Above it a sweep's amplitude falls, as a test bench's does."""


@dataclass
class Trip:
    """The recording while it is being driven; `speed` is the rigid vehicle's [rad/s]."""

    seconds: float
    base: Base
    speed: float = 0.0
    first_speed: float = 0.0
    torque: list[float] = field(default_factory=list)
    brake: list[float] = field(default_factory=list)
    sweep: tuple[float, float, float] = (0.0, 1.0, 1.0)
    """Amplitude [N*m], first and last frequency [Hz] of a sine sweep on top."""

    def begin(self, speed: float) -> None:
        """The speed before the first sample [rad/s]."""
        self.first_speed = self.speed = speed

    @property
    def left_s(self) -> float:
        """What is left of the recording [s]."""
        return self.seconds - len(self.torque) * TICK_S

    def hold(self) -> float:
        """The torque that keeps the speed [N*m]."""
        base, speed = self.base, self.speed
        load = base.f0 * math.tanh(speed / 0.2) + base.cd2 * speed * abs(speed) + base.b_w * speed
        return load / RATIO + base.b_em * RATIO * speed

    def go(
        self, seconds: float, first: float, last: float | None = None, brake: float = 0.0
    ) -> None:
        """Torque from `first` to `last` [N*m] in a straight line, brake torque constant."""
        ticks = min(round(seconds / TICK_S), math.ceil(self.left_s / TICK_S - 1e-9))
        end = first if last is None else last
        for tick in range(ticks):
            self.tick(first + (end - first) * tick / ticks, brake)

    def tick(self, torque: float, brake: float) -> None:
        """One decision: within the machine's limits, and the rigid vehicle moves on."""
        hold, power_speed = self.hold(), max(abs(self.speed) * RATIO, 1.0)
        largest = min(LARGEST_TORQUE, LARGEST_POWER / power_speed)
        given = max(LEAST_TORQUE, -largest, min(largest, torque))
        if self.speed > FASTEST:
            given = min(given, hold)
        if self.speed < FASTEST_BACK:
            given = max(given, 0.0)
        self.torque.append(given)
        self.brake.append(brake)
        inertia = self.base.J_v + RATIO * RATIO * self.base.J_em
        change = (given - hold) * RATIO * TICK_S / inertia
        stop = math.tanh(self.speed / 0.2) * brake * TICK_S / inertia
        self.speed += change - math.copysign(min(abs(stop), abs(self.speed)), stop)


def smooth_hann(values: Array, width_s: float) -> Array:
    """Smoothed by a raised cosine of that whole width, the ends held [N*m]."""
    half = max(1, round(0.5 * width_s / STEP_S))
    window = np.hanning(2 * half + 1)
    padded = np.pad(values, half, mode="edge")
    return np.convolve(padded, window / window.sum(), mode="valid")


def smooth_torques(trip: Trip, rows: int, pedal_s: float, pipe_s: float) -> Array:
    """Demand and brake torque [N*m] every STEP_S, smoothed by pedal and brake pipe."""
    ratio = round(TICK_S / STEP_S)
    torque = np.repeat(np.array(trip.torque), ratio)
    brake = np.repeat(np.array(trip.brake), ratio)
    torque, brake = (np.pad(one, (0, ratio), mode="edge")[:rows] for one in (torque, brake))
    amplitude, first, last = trip.sweep
    time = np.arange(rows) * STEP_S
    rate = math.log(last / first) / time[-1] if last > first else 1e-9
    phase = 2.0 * np.pi * first * np.expm1(rate * time) / rate
    weaker = 1.0 / np.hypot(1.0, first * np.exp(rate * time) / SWEEP_CORNER_HZ)
    swept = smooth_hann(torque, pedal_s) + amplitude * weaker * np.sin(phase)
    return np.column_stack([swept, np.maximum(smooth_hann(brake, pipe_s), 0.0)])
