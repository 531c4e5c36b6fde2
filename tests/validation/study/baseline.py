"""Baseline: what simpler methods would name, on the same recordings and the same recalibrated base.

- sparse regression (PySINDy, de Silva et al. 2020; Kaptanoglu et al. 2022) of what the balances of
  the recalibrated base lack, the states taken from its observer: the term that explains most;
- the effect that brings free simulation of the training recordings nearest.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pysindy
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from diagnosis.data.stacked_recordings import burn_in_samples
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.pipeline.diagnose import Diagnosis
from diagnosis.result.verdict import verdict_id
from diagnosis.validation.free_simulation import nrmse

Reals = NDArray[np.float64]
SMOOTHED = 0.05
"""Seconds of the Savitzky-Golay filter that gives derivatives."""
THRESHOLD, RIDGE = 0.05, 1e-3
POWER = 30e3
"""Power [W] from which a machine might give less."""
Signals = Mapping[str, Reals]
Terms = Mapping[str, Callable[[Signals], Sequence[Reals]]]
MOTOR: Terms = {
    "actuator_lag": lambda s: [s["T_em_rate"]],
    "actuator_delay": lambda s: [s["T_em_rate_of_rate"]],
    "torque_derating": lambda s: [
        np.sign(s["T_em"]) * np.maximum(np.abs(s["T_em"] * s["w_em"]) - POWER, 0.0)
    ],
    "torque_drift": lambda s: [s["T_em"] * s["time"]],
    "torque_offset": lambda s: [np.ones_like(s["time"])],
    "torque_ripple": lambda s: [f(s["angle_em"]) for f in (np.sin, np.cos)],
    "coulomb_friction": lambda s: [np.tanh(s["w_em"] / 2.0)],
    "stribeck_friction": lambda s: [np.tanh(s["w_em"] / 2.0) * np.exp(-np.abs(s["w_em"]) / 20.0)],
    "load_dependent_loss": lambda s: [np.abs(s["T_hs"]) * np.tanh(s["w_em"] / 2.0)],
}
WHEEL: Terms = {
    "road_grade": lambda s: [np.ones_like(s["time"])],
    "quadratic_drag": lambda s: [s["w_w"] * np.abs(s["w_w"])],
    "brake_drag": lambda s: [s["T_br_before"] * np.tanh(s["w_w"])],
    "stiffness_nonlinear": lambda s: [s["twist"] ** 3],
    "stiffness_hysteresis": lambda s: [np.abs(s["twist_rate"]) * s["twist"]],
    "position_dependent_stiffness": lambda s: [
        s["T_hs"] * f(s["angle_w"]) for f in (np.sin, np.cos)
    ],
    "mount_compliance": lambda s: [s["twist_rate"]],
    "tyre_slip": lambda s: [s["T_hs"] / np.maximum(np.abs(s["w_w"]), 1.0)],
    "sensor_eccentricity": lambda s: [s["w_w"] * f(s["angle_w"]) for f in (np.sin, np.cos)],
    "sensor_delay": lambda s: [s["w_w_rate"]],
    "sensor_scale": lambda s: [s["w_w"]],
}


def run_baselines(found: Diagnosis) -> dict[str, str]:
    """Return what each simpler method names."""
    base, bench = found.selection.base, found.model_set
    tried = {
        verdict_id(t.placed_effect, bench.automaton): t.estimate
        for t in found.selection.first_round
    }
    free = {name: one for name, one in tried.items() if one is not None}
    return {"sindy": by_regression(bench, base), "free_gain": by_simulation(bench, base, free)}


def by_simulation(bench: ModelSet, base: Estimate, fitted: Mapping[str, Estimate]) -> str:
    """Return the fitted effect that brings free simulation nearest; none where none does."""
    misfit = {name: float(np.mean(nrmse(one, bench.series))) for name, one in fitted.items()}
    limit = float(np.mean(nrmse(base, bench.series)))
    best = min(misfit, key=lambda name: misfit[name], default=None)
    return best if best is not None and misfit[best] < limit else "nothing_missing"


def by_regression(bench: ModelSet, base: Estimate) -> str:
    """Return the effect whose term has the largest part in what a balance of the base lacks."""
    signals = [_signals(bench, base, k) for k in range(len(bench.series))]
    found: dict[str, float] = {}
    for terms, lack in ((MOTOR, "lack_em"), (WHEEL, "lack_w")):
        names = [name for name, make in terms.items() for _ in make(signals[0])]
        columns = [
            np.column_stack([column for make in terms.values() for column in make(one)])
            for one in signals
        ]
        features, lacking = np.concatenate(columns), np.concatenate([one[lack] for one in signals])
        spread = np.maximum(features.std(axis=0) + np.abs(features.mean(axis=0)), 1e-12)
        scaled, size = features / spread, max(float(np.std(lacking)), 1e-12)
        regression = pysindy.STLSQ(threshold=THRESHOLD, alpha=RIDGE)
        regression.fit(scaled, lacking[:, None] / size)
        for name, part in zip(names, np.abs(regression.coef_[0]), strict=True):
            found[name] = max(found.get(name, 0.0), float(part))
    best = max(found, key=lambda name: found[name])
    return best if found[best] > 0.0 else "nothing_missing"


def _signals(bench: ModelSet, base: Estimate, k: int) -> Signals:
    """Return what terms are made of in one recording, once the states are found."""
    series, run, values = bench.series[k], base.prediction.predictions[k], dict(base.values(k))
    declared = bench.automaton.parameters
    known = {name: float(p.value) for name, p in declared.items() if p.value is not None} | values
    rows = slice(burn_in_samples(series), run.completed)
    names = base.candidate.predictor.states
    state = {name: run.states[rows, place] for place, name in enumerate(names)}
    fed = dict(zip(base.candidate.predictor.inputs, series.inputs[rows].T, strict=True))
    period = float(series.period)
    time = np.arange(len(fed["T_em"])) * period
    w_em, w_w = state["w_em"], state["w_w"]
    rate_em, rate_w = (_rate(values, period) for values in (w_em, w_w))
    twist = state["theta_d"] - state["theta_b"]
    twist_rate = w_em / known["R"] - w_w
    torque = known["k"] * twist + known["c"] * twist_rate * (np.abs(twist) > 1e-9)
    load = known["f0"] * np.tanh(w_w / known["w_sm"]) + known["cd2"] * w_w * np.abs(w_w)
    brake = fed["T_br"] * np.tanh(w_w / known["w_sm"])
    rate = _rate(fed["T_em"], period)
    return {
        "time": time,
        "T_em": fed["T_em"],
        "T_em_rate": rate,
        "T_em_rate_of_rate": _rate(rate, period),
        "T_br_before": np.maximum.accumulate(fed["T_br"]) * (fed["T_br"] < 1.0),
        "w_em": w_em,
        "w_w": w_w,
        "w_w_rate": rate_w,
        "angle_em": np.cumsum(w_em) * period,
        "angle_w": np.cumsum(w_w) * period,
        "twist": twist,
        "twist_rate": twist_rate,
        "T_hs": torque,
        "lack_em": known["J_em"] * rate_em
        - (fed["T_em"] - torque / known["R"] - known["b_em"] * w_em),
        "lack_w": known["J_v"] * rate_w - (torque - load - brake - known["b_w"] * w_w),
    }


def _rate(values: Reals, period: float) -> Reals:
    length = max(5, 2 * round(SMOOTHED / period / 2.0) + 1)
    found = savgol_filter(values, length, 3, deriv=1, delta=period)
    return np.asarray(found, dtype=np.float64)
