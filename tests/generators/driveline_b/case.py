"""Case: a driveline that is somewhat off, maybe with effects, and ten recordings of it.

Each matter has its own stream of random numbers. A case and its twin without effects have the same
manoeuvres, parameters, sensors, disturbances and noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from tests.generators.driveline_b.effect_catalogue import CATALOGUE, Sizes
from tests.generators.driveline_b.manoeuvre import (
    HELD_OUT,
    TRAIN,
    Manoeuvre,
    draw_disturbance,
    draw_manoeuvre,
)
from tests.generators.driveline_b.solver import RATE_HZ, Physics, Reals, simulate

RATES_HZ = (100, 200, 500, 1000)
NOMINAL = {
    "J_em": 0.05, "k": 6000.0, "c": 60.0, "alpha": 0.02, "b_em": 0.01, "J_v": 135.0, "b_w": 0.4,
    "f0": 45.0, "cd2": 0.030,
}  # fmt: skip
"""Values of the model that is diagnosed [SI]; the true ones are 5 to 20 % off."""
FILTER = 0.010
"""Time constant of the filter of the wheel speed [s], which the model knows."""
TORQUE_QUANTUM, BRAKE_NOISE = 0.25, 2.0
"""Quantum of the recorded motor torque and standard deviation of the brake torque [N*m]."""
BASE, SIZES, SENSORS, DRIVE, DISTURBANCES, NOISE = range(6)
ROW = "%.4f,%.7g,%.7g,%.7g,%.7g"
COLUMNS = "t_s,T_em_Nm,T_br_Nm,w_em_radps,w_w_radps"


@dataclass(frozen=True)
class Sensors:
    """Standard deviations and quanta of the recorded speeds [rad/s] and of the torque [N*m], and
    standard deviations of the disturbances at motor and wheel [N*m].
    """

    w_em: tuple[float, float]
    w_w: tuple[float, float]
    torque: float
    motor: float
    wheel: float


@dataclass(frozen=True)
class Case:
    """What was ordered; all else follows from seed and number."""

    seed: int
    number: int
    effects: tuple[str, ...]
    strength: float

    @property
    def name(self) -> str:
        """The name of the folder."""
        return f"case_{self.number:03d}"

    def stream(self, matter: int, *more: int) -> np.random.Generator:
        """Return the stream of random numbers of a matter."""
        return np.random.default_rng([self.seed, self.number, matter, *more])

    @cached_property
    def rate_hz(self) -> int:
        """Sampling rate of the recordings [Hz]."""
        return int(self.stream(SENSORS, 1).choice(RATES_HZ))

    @cached_property
    def base(self) -> dict[str, float]:
        """The true values of the parameters of the model [SI]."""
        rng = self.stream(BASE)
        values = {
            name: value * (1.0 + float(rng.choice((-1.0, 1.0))) * rng.uniform(0.05, 0.20))
            for name, value in NOMINAL.items()
        }
        return {**values, "tau_f": FILTER}

    @cached_property
    def sensors(self) -> Sensors:
        """Noise and quanta of the sensors, and sizes of the disturbances."""
        u = self.stream(SENSORS).uniform
        return Sensors(
            (u(0.05, 0.2), u(0.05, 0.15)), (u(0.01, 0.04), u(0.01, 0.04)),
            u(0.05, 0.3), u(0.1, 0.4), u(5.0, 15.0),
        )  # fmt: skip

    @cached_property
    def sizes(self) -> dict[str, Sizes]:
        """The sizes of each effect [SI]; empty at strength 0."""
        if self.strength == 0.0:
            return {}
        return {
            name: CATALOGUE[name].draw(self.stream(SIZES, *name.encode()), self.strength)
            for name in self.effects
        }

    @cached_property
    def physics(self) -> Physics:
        """The true driveline."""
        found = Physics(**self.base)
        for sizes in self.sizes.values():
            found = replace(found, **sizes)
        return found

    @property
    def label(self) -> dict[str, Any]:
        """What is true of the case: effects, places, sizes, strength, rate and parameters."""
        return {
            "effects": [
                {"id": name, "place": CATALOGUE[name].place, "parameters": sizes}
                for name, sizes in self.sizes.items()
            ],
            "strength": self.strength if self.effects else 0.0,
            "rate_Hz": self.rate_hz,
            "base": self.base,
            "seed": self.seed,
            "number": self.number,
            "manoeuvres": {"train": list(TRAIN), "held_out": list(HELD_OUT)},
        }

    def record(self, kind: str, serial: int) -> Reals:
        """Return a recording (samples, 5): time [s], torques [N*m] and speeds [rad/s]."""
        rng = self.stream(DRIVE, serial)
        manoeuvre, angle = draw_manoeuvre(kind, rng), rng.uniform(0.0, 6.0)
        slope = float(rng.choice((-1.0, 1.0))) * rng.uniform(0.4, 1.0)
        physics = replace(self.physics, grade=self.physics.grade * slope)
        stride = RATE_HZ // self.rate_hz
        speeds = simulate(physics, self._inputs(manoeuvre, serial), stride, manoeuvre.speed, angle)
        return self._measure(manoeuvre, speeds, stride, serial)

    def _inputs(self, manoeuvre: Manoeuvre, serial: int) -> Reals:
        """Return delivered demand, brake, and disturbances at motor and wheel [N*m] (rows, 4)."""
        rng, count = self.stream(DISTURBANCES, serial), len(manoeuvre.torque)
        late = round(self.physics.delay * RATE_HZ)
        demand = np.concatenate([np.full(late, manoeuvre.torque[0]), manoeuvre.torque])[:count]
        motor = draw_disturbance(count, 0.5, self.sensors.motor, rng)
        wheel = draw_disturbance(count, 1.0, self.sensors.wheel, rng)
        return np.stack([demand, manoeuvre.brake, motor, wheel], axis=1)

    def _measure(self, manoeuvre: Manoeuvre, speeds: Reals, stride: int, serial: int) -> Reals:
        """Return the samples with delay, noise and quantisation (samples, 5)."""
        rng, count = self.stream(NOISE, serial), len(speeds)
        time = np.arange(count) / self.rate_hz
        w_w = np.interp(time - self.physics.late, time, speeds[:, 1])
        rows = [(speeds[:, 0], *self.sensors.w_em), (w_w, *self.sensors.w_w)]
        torque, brake = (u[::stride][:count] for u in (manoeuvre.torque, manoeuvre.brake))
        noisy = [
            _quantise(values + std * rng.standard_normal(count), quantum)
            for values, std, quantum in [*rows, (torque, self.sensors.torque, TORQUE_QUANTUM)]
        ]
        pressed = brake + BRAKE_NOISE * rng.standard_normal(count) * (brake > 0.0)
        return np.stack([time, noisy[2], pressed, noisy[0], noisy[1]], axis=1)


def _quantise(values: Reals, quantum: float) -> Reals:
    """Return values rounded to multiples of a quantum."""
    return np.asarray(np.round(values / quantum) * quantum)


def write_case(case: Case, folder: Path) -> dict[str, Any]:
    """Write the recordings of a case below a folder; return its label."""
    kinds = [("train", TRAIN), ("held_out", HELD_OUT)]
    for part, names in kinds:
        place = folder / case.name / part
        place.mkdir(parents=True, exist_ok=True)
        for index, kind in enumerate(names):
            rows = case.record(kind, index + len(TRAIN) * (part == "held_out"))
            text = "\n".join(ROW % tuple(row) for row in rows.tolist())
            (place / f"rec_{index:02d}.csv").write_text(f"{COLUMNS}\n{text}\n", encoding="ascii")
    return case.label
