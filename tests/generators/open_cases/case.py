"""Case: a driveline that is somewhat off, maybe an effect, and ten recordings of it.

Everything is drawn from the seed and the number of the case, in streams of their own: two cases
that differ in the effect alone have the same manoeuvres, base values, sensors and file shapes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tests.generators.open_cases.driveline import NOMINAL, Driveline, columns_of, perturb_driveline
from tests.generators.open_cases.driveline_simulation import STEP, Demand, Parts, integrate_motion
from tests.generators.open_cases.effect import Floats, Parameters, Signals, Speeds, sensor_speeds
from tests.generators.open_cases.effect_catalogue import LIBRARY
from tests.generators.open_cases.manoeuvre import HELD_OUT, SETTLING, TRAIN, Manoeuvre, manoeuvres
from tests.generators.open_cases.sensor import apply_sensor_filter

RATES = (100, 200, 500, 1000)
"""Sampling rates [Hz]; every period is a multiple of the inner step."""
STREAMS = ("manoeuvres", "base", "effects", "course", "sensors", "noise")


@dataclass(frozen=True)
class DrawnEffect:
    """An effect of the library with its drawn parameters."""

    name: str
    parameters: Parameters


@dataclass(frozen=True)
class Sensors:
    """Noise (standard deviation) and quantum of the recorded columns [N*m, rad/s]."""

    T_em: tuple[float, float]
    T_br: tuple[float, float]
    w_em: tuple[float, float]
    w_w: tuple[float, float]


@dataclass(frozen=True)
class Case:
    """All that is to be simulated and recorded; `train` of the manoeuvres are for training."""

    seed: int
    number: int
    rate: int
    driveline: Driveline
    effects: tuple[DrawnEffect, ...]
    manoeuvres: tuple[Manoeuvre, ...]
    train: int
    sensors: Sensors


def stream(seed: int, number: int, name: str) -> np.random.Generator:
    """Return the named stream of random numbers of a case."""
    key = (number, STREAMS.index(name))
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))


def draw_case(
    seed: int, number: int, effects: Sequence[str], strength: float = 1.0, rate: int | None = None
) -> Case:
    """Draw a case; at strength 0 it has no effect. The rate [Hz] is drawn where none is given."""
    course = stream(seed, number, "manoeuvres")
    plans = [*manoeuvres(course, TRAIN), *manoeuvres(course, HELD_OUT)]
    sensors = stream(seed, number, "sensors")
    some_rate = int(sensors.choice(RATES))
    effect = stream(seed, number, "effects")
    chosen = tuple(
        DrawnEffect(name, LIBRARY[name].draw(effect, strength))
        for name in LIBRARY
        if name in effects and strength > 0.0
    )
    return Case(
        seed,
        number,
        rate or some_rate,
        perturb_driveline(NOMINAL, stream(seed, number, "base")),
        chosen,
        tuple(plans),
        len(TRAIN),
        _sensors(sensors),
    )


def _sensors(generator: np.random.Generator) -> Sensors:
    """Draw noise and quanta as production sensors have them."""
    return Sensors(
        (float(generator.uniform(0.1, 0.4)), 0.25),
        (float(generator.uniform(0.5, 2.0)), 1.0),
        (float(generator.uniform(0.05, 0.20)), float(generator.choice((0.05, 0.10)))),
        (float(generator.uniform(0.01, 0.04)), float(generator.choice((0.01, 0.02)))),
    )


@dataclass(frozen=True)
class SimulatedRecording:
    """One recording on the inner steps from t = 0: torques [N*m], speeds [rad/s], (n_steps + 1,).

    The torques are those asked for, the wheel speed is that after the sensor's filter.
    """

    T_em: Floats
    T_br: Floats
    w_em: Floats
    w_w: Floats


def simulate_cases(
    cases: Sequence[Case], step: float = STEP, settling_time: float = SETTLING
) -> list[list[SimulatedRecording]]:
    """Simulate the cases side by side; the number of cases at a time changes no value."""
    longest = max(m.duration for case in cases for m in case.manoeuvres)
    settling = round(settling_time / step)
    n_steps = settling + round(longest / step)
    time: Floats = np.asarray((np.arange(n_steps) + 0.5 - settling) * step, dtype=np.float64)
    ends = np.cumsum([len(case.manoeuvres) for case in cases]).tolist()
    columns = [slice(end - len(c.manoeuvres), end) for end, c in zip(ends, cases, strict=True)]
    demand = Demand(*(np.zeros((n_steps, ends[-1])) for _ in range(3)))
    parts: list[tuple[slice, Parts]] = []
    drivelines: list[Driveline] = []
    for case, own in zip(cases, columns, strict=True):
        signals = _acted(case, time)
        demand.torque[:, own], demand.brake[:, own] = signals.torque, signals.brake
        demand.road[:, own] = signals.road
        driveline = _changed(case)
        drivelines += [driveline] * len(case.manoeuvres)
        for chosen in case.effects:
            make = LIBRARY[chosen.name].parts
            if make is not None:
                parts.append((own, make(chosen.parameters, driveline)))
    start = (
        np.array([m.wheel_speed for case in cases for m in case.manoeuvres]),
        np.concatenate([_angles(case) for case in cases]),
    )
    motion = integrate_motion(columns_of(drivelines), demand, start, parts, step)
    return [
        _cut(case, sensor_speeds(motion, own, step), settling)
        for case, own in zip(cases, columns, strict=True)
    ]


def _angles(case: Case) -> Floats:
    """Draw the motor angle [rad] at the start of each recording."""
    generator = stream(case.seed, case.number, "course")
    return generator.uniform(0.0, 2.0 * np.pi, len(case.manoeuvres))


def _acted(case: Case, time: Floats) -> Signals:
    """Return what drives the recordings, the effects applied."""
    torque = np.stack([m.torques(time) for m in case.manoeuvres], axis=1)
    brake = np.stack([m.brakes(time) for m in case.manoeuvres], axis=1)
    ends = tuple(m.duration for m in case.manoeuvres)
    signals = Signals(time, torque, brake, np.zeros_like(torque), ends)
    generator = stream(case.seed, case.number, "noise").spawn(1)[0]
    for chosen in case.effects:
        signals = LIBRARY[chosen.name].signals(signals, chosen.parameters, generator)
    return signals


def _changed(case: Case) -> Driveline:
    """Return the driveline with what the effects change of its values."""
    driveline = case.driveline
    for chosen in case.effects:
        driveline = LIBRARY[chosen.name].driveline(driveline, chosen.parameters)
    return driveline


def _cut(case: Case, speeds: Speeds, settling: int) -> list[SimulatedRecording]:
    """Apply the sensors and cut each recording to its length."""
    for chosen in case.effects:
        speeds = LIBRARY[chosen.name].speeds(speeds, chosen.parameters)
    speeds = apply_sensor_filter(speeds, case.driveline.tau_f)
    cut: list[SimulatedRecording] = []
    for column, manoeuvre in enumerate(case.manoeuvres):
        count = round(manoeuvre.duration / speeds.step) + 1
        rows = slice(settling, settling + count)
        time = np.asarray(np.arange(count) * speeds.step, dtype=np.float64)
        cut.append(
            SimulatedRecording(
                manoeuvre.torques(time),
                manoeuvre.brakes(time),
                speeds.w_em[rows, column].copy(),
                speeds.w_w[rows, column].copy(),
            )
        )
    return cut
