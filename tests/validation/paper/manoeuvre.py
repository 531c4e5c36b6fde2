"""Manoeuvre: the runs that the paper's figures show, from `spec/paper`."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

import modewright as mw
from tests.validation.evidence.evidence_store import ROOT

STEP = 0.4785
"""When the torque steps [s]: 1.5 ms before a tick at 100 Hz."""
RATES = {"100": "at_100Hz", "1000": "at_1kHz", "10000": "at_10kHz"}
"""Estimators by the rate of their inputs [Hz]."""
Reals = NDArray[np.float64]


@lru_cache
def run_scenario(scenario: str, system: str = "paper") -> mw.Trajectory:
    """Return a run of a scenario of the paper."""
    found: mw.Trajectory = mw.simulate(system, scenario, root=ROOT)
    return found


def signal(trajectory: mw.Trajectory, name: str) -> Reals:
    """Return a signal of a run as reals [SI] (n_samples,)."""
    return np.asarray(trajectory.signals[name], dtype=np.float64)


def first_loss(trajectory: mw.Trajectory, instance: str) -> float:
    """Return when an instance first enters the mode without contact after the step [s]."""
    gaps = ("no_contact", "gap")
    return next(
        event.time
        for event in trajectory.events_of(instance)
        if event.target in gaps and event.time > STEP
    )


def table_1() -> dict[str, float]:
    """Return the delay until the first loss of contact is seen, by rate [ms]: Table 1."""
    tip_out = run_scenario("paper_tip_out")
    lost = first_loss(tip_out, "plant")
    return {rate: 1e3 * (first_loss(tip_out, name) - lost) for rate, name in RATES.items()}


def landing_lead_time(instance: str) -> float:
    """Return how long before the coast side is met an estimator sees the first gap [ms]."""
    tip_out = run_scenario("paper_tip_out")
    met = next(e.time for e in tip_out.events_of("plant") if e.target == "coast_contact")
    return 1e3 * (met - first_loss(tip_out, instance))


def cycles(times: Reals, rate: Reals, begin: float) -> tuple[Reals, Reals]:
    """Return when each cycle of a shuffle ends [s], and its frequency [Hz].

    `rate` is that of the twist [rad/s] (n_samples,): a cycle is from one upward crossing of 0
    to the next, each located on the straight line between two samples.
    """
    kept = times >= begin
    t, w = times[kept], rate[kept]
    (up,) = np.nonzero((w[:-1] < 0.0) & (w[1:] >= 0.0))
    crossings = t[up] - w[up] * (t[up + 1] - t[up]) / (w[up + 1] - w[up])
    return crossings[1:], 1.0 / np.diff(crossings)
