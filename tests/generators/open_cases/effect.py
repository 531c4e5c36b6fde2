"""Effect: a piece of physics that a case may have, with its place and its parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tests.generators.open_cases.driveline import Driveline
from tests.generators.open_cases.driveline_simulation import Motion, Parts

Floats = NDArray[np.float64]
Parameters = dict[str, float]


@dataclass(frozen=True)
class Signals:
    """What drives the recordings of one case, at the middles of the steps."""

    time: Floats
    """Since the start of the recording [s], (n_steps,); negative while settling."""
    torque: Floats
    """Motor torque [N*m], (n_steps, n_recordings)."""
    brake: Floats
    """Brake torque at the wheel [N*m], (n_steps, n_recordings)."""
    road: Floats
    """Extra torque of the road against the motion [N*m], (n_steps, n_recordings)."""
    ends: tuple[float, ...]
    """Length of each recording [s]; the steps may go on after it."""

    @property
    def step(self) -> float:
        """Return the distance of two middles [s]."""
        return float(self.time[1] - self.time[0])


@dataclass(frozen=True)
class Speeds:
    """Motor and wheel speed as the sensors see them [rad/s], (n_steps + 1, n_recordings)."""

    w_em: Floats
    w_w: Floats
    angle_w: Floats
    """Wheel angle [rad]."""
    step: float


def same_driveline(driveline: Driveline, parameters: Parameters) -> Driveline:
    """Leave the base values alone."""
    return driveline


def same_signals(
    signals: Signals, parameters: Parameters, generator: np.random.Generator
) -> Signals:
    """Leave the signals alone."""
    return signals


def same_speeds(speeds: Speeds, parameters: Parameters) -> Speeds:
    """Leave the speeds alone."""
    return speeds


@dataclass(frozen=True)
class Effect:
    """An effect acts on base values, signals, motion or sensors; most act on one of them."""

    name: str
    place: str
    draw: Callable[[np.random.Generator, float], Parameters]
    """Parameters at a strength: 1 is plain to see, 0 (never drawn) would be nothing."""
    driveline: Callable[[Driveline, Parameters], Driveline] = same_driveline
    signals: Callable[[Signals, Parameters, np.random.Generator], Signals] = same_signals
    parts: Callable[[Parameters, Driveline], Parts] | None = None
    speeds: Callable[[Speeds, Parameters], Speeds] = same_speeds


def sensor_speeds(motion: Motion, columns: slice, step: float) -> Speeds:
    """Return the speeds of some columns of the motion."""
    rows = (motion.w_em[:, columns], motion.w_w[:, columns], motion.angle_w[:, columns])
    return Speeds(*rows, step)


def with_torque(signals: Signals, torque: Floats) -> Signals:
    """Return the signals with another motor torque."""
    return replace(signals, torque=torque)


def draw_sign(generator: np.random.Generator) -> float:
    """Return 1 or -1."""
    return float(generator.choice((-1.0, 1.0)))
