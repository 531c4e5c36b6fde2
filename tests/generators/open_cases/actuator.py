"""Effects of the actuator: the motor torque is not what was asked for."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.signal import lfilter

from tests.generators.open_cases.driveline import Driveline
from tests.generators.open_cases.driveline_simulation import (
    ANGLE_EM,
    W_EM,
    Part,
    Parts,
    StepMidpoint,
)
from tests.generators.open_cases.effect import (
    Effect,
    Floats,
    Parameters,
    Signals,
    draw_sign,
    with_torque,
)

PLACE = "inputs.T_em"


def apply_lag(values: Floats, tau: float, step: float) -> Floats:
    """Return values after a first-order lag [s] (bilinear), settled at the first row."""
    if tau == 0.0:
        return values
    share = step / (step + 2.0 * tau)
    settled = (1.0 - share) * values[:1]
    filtered, _ = lfilter([share, share], [1.0, 2.0 * share - 1.0], values, axis=0, zi=settled)
    return np.asarray(filtered)


def apply_delay(values: Floats, delay: float, step: float) -> Floats:
    """Return values as they were `delay` [s] ago, linear in between, held before the start."""
    count = values.shape[0]
    index = np.clip(np.arange(count) - delay / step, 0.0, count - 1.0)
    lower = np.minimum(index.astype(np.intp), count - 2)
    share = (index - lower)[:, np.newaxis]
    return np.asarray((1.0 - share) * values[lower] + share * values[lower + 1])


def _lag(signals: Signals, p: Parameters, generator: np.random.Generator) -> Signals:
    """Current control as a first-order lag (Leonhard 2001, Control of Electrical Drives)."""
    return with_torque(signals, apply_lag(signals.torque, p["tau_s"], signals.step))


def _delay(signals: Signals, p: Parameters, generator: np.random.Generator) -> Signals:
    """Dead time of bus and inverter."""
    return with_torque(signals, apply_delay(signals.torque, p["delay_s"], signals.step))


def _rate_limit(signals: Signals, p: Parameters, generator: np.random.Generator) -> Signals:
    """Follow the demand no faster than the limit."""
    most = p["rate_Nm_per_s"] * signals.step
    torque = np.array(signals.torque)
    for before, after in pairwise(torque):
        np.clip(after, before - most, before + most, out=after)
    return with_torque(signals, torque)


def _drift(signals: Signals, p: Parameters, generator: np.random.Generator) -> Signals:
    """Warm magnets lose flux: the gain falls as 1 - d*(1 - exp(-t/tau)) in each recording."""
    warmth = -np.expm1(-np.clip(signals.time, 0.0, None) / p["tau_s"])
    return with_torque(signals, signals.torque * (1.0 - p["loss"] * warmth)[:, np.newaxis])


def _gain(signals: Signals, p: Parameters, generator: np.random.Generator) -> Signals:
    return with_torque(signals, signals.torque * p["gain"])


def _offset(signals: Signals, p: Parameters, generator: np.random.Generator) -> Signals:
    return with_torque(signals, signals.torque + p["offset_Nm"])


def _derating(p: Parameters, driveline: Driveline) -> Parts:
    """Constant power above the corner speed (field weakening): abs(T*w) <= P."""

    def bind(columns: slice, row: int) -> dict[str, Part]:
        def actuator(middle: StepMidpoint) -> None:
            most = p["power_W"] / np.maximum(np.abs(middle.state[W_EM, columns]), 1.0)
            torque = middle.torque[columns]
            np.clip(torque, -most, most, out=torque)

        return {"actuator": actuator}

    return Parts((), bind)


def _ripple(p: Parameters, driveline: Driveline) -> Parts:
    """Torque over the rotor angle (Jahns, Soong 1996, IEEE Trans. Ind. Electron. 43, 321-330)."""

    def bind(columns: slice, row: int) -> dict[str, Part]:
        def actuator(middle: StepMidpoint) -> None:
            angle = p["order"] * middle.state[ANGLE_EM, columns] + p["phase_rad"]
            middle.torque[columns] += p["amplitude_Nm"] * np.sin(angle)

        return {"actuator": actuator}

    return Parts((), bind)


ACTUATOR = (
    Effect(
        "actuator_lag", PLACE, lambda g, s: {"tau_s": s * g.uniform(0.018, 0.045)}, signals=_lag
    ),
    Effect(
        "actuator_delay",
        PLACE,
        lambda g, s: {"delay_s": s * g.uniform(0.015, 0.040)},
        signals=_delay,
    ),
    Effect(
        "torque_rate_limit",
        PLACE,
        lambda g, s: {"rate_Nm_per_s": g.uniform(200.0, 450.0) / s},
        signals=_rate_limit,
    ),
    Effect(
        "torque_derating",
        PLACE,
        lambda g, s: {"power_W": g.uniform(14e3, 26e3) / s},
        parts=_derating,
    ),
    Effect(
        "torque_drift",
        PLACE,
        lambda g, s: {"loss": s * g.uniform(0.18, 0.35), "tau_s": g.uniform(2.0, 5.0)},
        signals=_drift,
    ),
    Effect(
        "torque_gain",
        PLACE,
        lambda g, s: {"gain": 1.0 + s * draw_sign(g) * g.uniform(0.15, 0.30)},
        signals=_gain,
    ),
    Effect(
        "torque_offset",
        PLACE,
        lambda g, s: {"offset_Nm": s * draw_sign(g) * g.uniform(4.0, 10.0)},
        signals=_offset,
    ),
    Effect(
        "torque_ripple",
        PLACE,
        lambda g, s: {
            "order": float(g.choice((2.0, 4.0, 6.0))),
            "amplitude_Nm": s * g.uniform(4.0, 9.0),
            "phase_rad": g.uniform(0.0, 6.283),
        },
        parts=_ripple,
    ),
)
