"""The laws of `spec/effects` written out, so that they can be fitted in no time.

That they are the library's is tested in test_forms.py, against the engine.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter, lsim

Array = npt.NDArray[Any]
TURN = 2 * np.pi


def first_order(u: Array, step: float, tau: float, begin: float | None = None) -> Array:
    """One lag of what goes in straight lines between the samples, exactly."""
    kept = np.exp(-step / tau)
    new = 1 - tau / step * (1 - kept)
    start = float(u[0]) if begin is None else begin
    found, _ = lfilter([new, 1 - kept - new], [1, -kept], u[1:], zi=[
        kept * start + (1 - kept - new) * u[0]
    ])  # fmt: skip
    return np.concatenate([[start], found])


def lag(u: Array, step: float, tau: float, part: float) -> Array:
    """actuator_lag, sensor_lag."""
    one = first_order(u, step, tau)
    three = first_order(first_order(one, step, tau), step, tau)
    return np.asarray(one + part * (three - one))


def delay(u: Array, step: float, late: float) -> Array:
    """actuator_delay, sensor_delay."""
    time = step * np.arange(len(u))
    return np.asarray(np.interp(time - late, time, u))


def rate_limit(u: Array, step: float, r_max: float, tau_f: float, fall: float = 1.0) -> Array:
    """torque_rate_limit: midpoint rule."""
    found, last = [float(u[0])], float(u[0])
    given = u.tolist()
    for now, then in pairwise(given):
        rate = max(-fall * r_max, min(r_max, (now - last) / tau_f))
        half = last + 0.5 * step * rate
        rate = max(-fall * r_max, min(r_max, (0.5 * (now + then) - half) / tau_f))
        last += step * rate
        found.append(last)
    return np.array(found)


def derating(u: Array, speed: Array, p_max: float, share: float = 1.0) -> Array:
    """torque_derating."""
    limit = p_max / np.maximum(np.abs(speed), 1.0)
    return np.asarray(u - share * (u - np.clip(u, -limit, limit)))


def drift(u: Array, step: float, drop: float, tau_d: float, load: float, warm_0: float) -> Array:
    """torque_drift."""
    warm = first_order(1 - load + load * (u / 100) ** 2, step, tau_d, warm_0)
    return np.asarray(u * (1 - drop * warm))


def ripple(
    u: Array,
    angle: Array,
    a: float,
    order: float,
    phase: float,
    s_2: float = 0.0,
    c_2: float = 0.0,
) -> Array:
    """torque_ripple."""
    turn = order * angle + phase
    return np.asarray(u + a * (np.sin(turn) + s_2 * np.sin(2 * turn) + c_2 * np.cos(2 * turn)))


def dry(w: Array, t_c: float, rise: float, w_k: float, w_s: float) -> Array:
    """stribeck_friction; with no rise coulomb_friction."""
    return np.asarray(t_c * (1 + rise * np.exp(-((w / w_k) ** 2))) * np.tanh(w / w_s))


def load_loss(load: Array, w: Array, loss: float, w_s: float) -> Array:
    """load_dependent_loss."""
    return np.asarray(loss * np.abs(load) * np.tanh(w / w_s))


def brake_drag(brake: Array, step: float, t_r: float, share: float, tau_b: float) -> Array:
    """brake_drag, at a speed far above that at which tanh bends."""
    rub, held, found = 0.0, 0.0, []
    for torque in np.abs(brake).tolist():
        on = torque > 10.0
        found.append(0.0 if on else rub * t_r + share * held)
        kept = np.exp(-step / (0.2 if on else tau_b))
        rub = on + (rub - on) * kept
        goal = torque if on else 0.0
        held = goal + (held - goal) * kept
    return np.array(found)


def with_gap(x: Array, rate: Array, step: float, k: float, c: float, alpha: float) -> Array:
    """Spring and damper behind a gap that is crossed as by Nordin, Galic, Gutman."""
    relaxed, stretch, found = float(np.exp(-step * k / c)), 0.0, []
    for twist, speed in zip(x.tolist(), rate.tolist(), strict=True):
        place = max(-alpha, min(alpha, twist - stretch * relaxed))
        stretch = twist - place
        torque = k * stretch + c * speed
        if place >= alpha:
            found.append(max(0.0, torque))
        elif place <= -alpha:
            found.append(min(0.0, torque))
        else:
            found.append(0.0)
    return np.array(found)


def second_gap(x: Array, rate: Array, k_2: float, c_2: float, a_2: float) -> Array:
    """second_gap: its contact, damped as it is pressed in by 3 mrad."""
    push = x - np.clip(x, -a_2, a_2)
    return np.asarray(k_2 * push + c_2 * np.minimum(np.abs(push) / 3e-3, 1.0) * rate)


def nonlinear(x: Array, k: float, q: float, x_r: float) -> Array:
    """stiffness_nonlinear, with its spring."""
    y = (x / x_r) ** 2
    return np.asarray(k * x * (1 + q * y / (1 + y)))


def hysteresis(x: Array, k: float, k_r: float, f_r: float) -> Array:
    """stiffness_hysteresis, with its spring."""
    torque, found = 0.0, [0.0]
    for change in np.diff(x).tolist():
        goal = f_r if change > 0 else -f_r
        torque = goal + (torque - goal) * np.exp(-k_r * abs(change) / f_r)
        found.append(torque)
    return np.asarray(k * x + np.array(found))


def position(
    x: Array, angle: Array, k: float, a: float, order: float, phase: float, more: Array
) -> Array:
    """position_dependent_stiffness, with its spring; `more`: s_2, c_2, s_3, c_3."""
    turn = order * angle + phase
    wave = a * np.sin(turn) + more[0] * np.sin(2 * turn) + more[1] * np.cos(2 * turn)
    wave += more[2] * np.sin(3 * turn) + more[3] * np.cos(3 * turn)
    return np.asarray(k * x * (1 + wave))


def mount(torque: Array, step: float, inertia: float, k: float, c: float) -> Array:
    """mount_compliance: angle of the housing that takes the reaction of `torque`."""
    matrix = [[0.0, 1.0], [-k / inertia, -c / inertia]]
    return _moved(matrix, [0.0, -1.0 / inertia], torque, step)[:, 0]


def compliance(torque: Array, step: float, total: float, near: float, k: float, c: float) -> Array:
    """compliance: change of speed of the near side under `torque` on it."""
    one, two = total * near, total * (1 - near)
    matrix = [[-c / one, c / one, -k / one], [c / two, -c / two, k / two], [1.0, -1.0, 0.0]]
    return _moved(matrix, [1.0 / one, 0.0, 0.0], torque, step)[:, 0]


def _moved(matrix: list[list[float]], column: list[float], u: Array, step: float) -> Array:
    size = len(matrix)
    model = (np.array(matrix), np.array(column)[:, None], np.eye(size), np.zeros((size, 1)))
    return np.asarray(lsim(model, u, step * np.arange(len(u)))[1])


def tyre_slip(torque: Array, c_t: float) -> Array:
    """tyre_slip: what it settles at, relative to the speed."""
    return np.asarray(torque / c_t)


def eccentric(
    y: Array, angle: Array, ecc: float, phase: float, tau: float, order: float = 1.0
) -> Array:
    """sensor_eccentricity: `y` and its angle are behind a filter, the tone is before it."""
    ahead, x = order * (angle + tau * y) + phase, order * tau * y
    tone = (np.sin(ahead) - x * np.cos(ahead)) / (1 + x**2)
    return np.asarray(y * (1 + ecc * tone))
