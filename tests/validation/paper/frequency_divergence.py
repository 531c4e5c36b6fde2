"""Divergence: a model tuned right after a tip, beside a car that has something more in its shaft.

The paper: "the model was tuned to match the oscillation right after the event"; about 1 s later
frequencies differ. The car is `driveline_rubber`; k_hs, c_hs and alpha of the model are fitted to
its motor speed from the step on for 0.35 s.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import least_squares

import modewright as mw
from tests.validation.evidence.evidence_store import ROOT
from tests.validation.paper.manoeuvre import STEP, Reals, cycles, run_scenario, signal

FITTED = 0.35
"""How long after the step the model is fitted [s], as in the paper."""
NOMINAL = {"k_hs": 4800.0, "c_hs": 14.0, "alpha": 0.0256}
UNITS = {"k_hs": "N*m/rad", "c_hs": "N*m*s/rad", "alpha": "rad"}
LATER = ((0.0, 0.35), (0.35, 0.7), (0.7, 1.0), (1.0, 1.5))
"""Parts after the step in which the error is told [s]."""


@dataclass(frozen=True)
class Divergence:
    """A fitted model beside the car.

    `values` [SI], `error` of the motor speed relative to its shuffle, by part (`LATER`), the last
    frequencies of both [Hz], and the runs: times [s] (n_samples,), motor speeds [rad/s].
    """

    values: dict[str, float]
    error: tuple[float, ...]
    frequencies: tuple[float, float]
    times: Reals
    car: Reals
    model: Reals


@lru_cache
def fit_divergence(scenario: str) -> Divergence:
    """Fit the model to the car in a scenario, and tell how they part."""
    car = run_scenario(scenario, "paper_car")
    times, seen = car.times, signal(car, "car.w_em")
    fitted = (times >= STEP) & (times <= STEP + FITTED)
    count = int(np.sum(times <= STEP + FITTED))
    side = np.sign(car.signals["car.theta_b"][0])
    torque = float(car.signals["car.T_hs"][0])

    def simulated(scales: Reals, ending: str = "_start") -> mw.Trajectory:
        values = {"model.side": f"{side:.0f}", "model.T_hs_0": f"{torque!r} N*m"}
        for (name, nominal), scale in zip(NOMINAL.items(), scales.tolist(), strict=True):
            values[f"model.{name}"] = f"{nominal * scale!r} {UNITS[name]}"
        return mw.simulate("paper_car", scenario + ending, values, ROOT)

    def misfit(scales: Reals) -> Reals:
        speed = signal(simulated(scales), "model.w_em")[:count]
        found: Reals = (speed - seen[:count])[fitted[:count]]
        return found

    best = least_squares(misfit, np.ones(3), bounds=(0.5, 2.0), diff_step=1e-3, xtol=1e-4)
    model = simulated(best.x, "")
    speed = signal(model, "model.w_em")
    shuffle = seen - np.polyval(np.polyfit(times[times > STEP], seen[times > STEP], 2), times)
    error = []
    for begin, end in LATER:
        part = (times >= STEP + begin) & (times < STEP + end)
        size = np.sqrt(np.mean(shuffle[part] ** 2))
        error.append(float(np.sqrt(np.mean((speed - seen)[part] ** 2)) / size))
    late = [cycles(times, signal(r, f"{n}.w_d"), STEP + 0.7)[1][:4].mean()
            for r, n in ((car, "car"), (model, "model"))]  # fmt: skip
    values = dict(zip(NOMINAL, (best.x * np.array([*NOMINAL.values()])).tolist(), strict=True))
    return Divergence(values, tuple(error), (late[0], late[1]), times, seen, speed)
