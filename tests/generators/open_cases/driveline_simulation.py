"""Motion: the driveline integrated over time, many recordings side by side.

One evaluation per step at the predicted middle, x_next = x + h*f(x + h/2*f_before): second order
(two-step Adams-Bashforth in the form of a midpoint rule; Hairer, Norsett, Wanner 1993, III.1).
The gap follows Nordin, Galic, Gutman 1997 (Int. J. Adapt. Control Signal Process. 11, 49-63):
between the contacts the gap angle moves so that the shaft torque is zero; the step average of its
speed is clipped such that the angle stays within the gap, which locates a contact inside a step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

STEP = 0.00025
"""Inner step [s]; halving it moves the speeds by less than a tenth of the sensor noise."""
W_EM, W_W, TWIST, GAP, ANGLE_EM, ANGLE_W = range(6)
"""Rows of the state: motor and wheel speed [rad/s]; twist of shaft and gap together, gap angle,
motor and wheel angle [rad]."""
STAGES = ("actuator", "upstream", "shaft", "reaction", "friction", "memory", "vehicle")


@dataclass(frozen=True)
class StepMidpoint:
    """The middle of a step; rows are (n_columns,), parts write to their own columns."""

    state: Floats
    rate: Floats
    start: Floats
    """State at the start of the step."""
    base: dict[str, Floats]
    step: float
    torque: Floats
    """Motor torque [N*m]."""
    upstream: Floats
    """Speed of the motor end of shaft and gap, at the wheel [rad/s]."""
    stiffness: Floats
    """Stiffness of the shaft [N*m/rad]."""
    remembered: Floats
    """Torque of the shaft beside stiffness and damping [N*m]."""
    shaft: Floats
    """Torque of the half-shafts [N*m]."""
    elastic: Floats
    """Speed of the elastic twist [rad/s]."""
    reaction: Floats
    """Torque against the gear, at the wheel [N*m]."""
    friction: Floats
    """Torque lost at the motor [N*m]."""
    brake: Floats
    """Brake torque with its sign [N*m]."""
    road: Floats
    """Extra torque of the road [N*m]."""


Part = Callable[[StepMidpoint], None]


@dataclass(frozen=True)
class Parts:
    """What an effect adds to the motion: rows of state, and functions of its stages."""

    rolling: tuple[bool, ...]
    """For each own row: does it start with the wheel speed (else from zero)?"""
    bind: Callable[[slice, int], dict[str, Part]]
    """From the effect's columns and first own row to its functions, by stage."""


@dataclass(frozen=True)
class Demand:
    """Signals at the middles of all steps, (n_steps, n_columns): torques [N*m]."""

    torque: Floats
    brake: Floats
    road: Floats


@dataclass(frozen=True)
class Motion:
    """Motor and wheel speed [rad/s], wheel angle [rad] at all steps, (n_steps + 1, n_columns)."""

    w_em: Floats
    w_w: Floats
    angle_w: Floats


def integrate_motion(
    base: dict[str, Floats],
    demand: Demand,
    start: tuple[Floats, Floats],
    parts: Sequence[tuple[slice, Parts]],
    step: float = STEP,
) -> Motion:
    """Integrate from wheel speeds [rad/s] and motor angles [rad], both (n_columns,)."""
    n_steps, n_columns = demand.torque.shape
    state, functions = _prepared(base, start, parts)
    middle = _middle(base, state, step)
    w_em, w_w, angle_w = (np.empty((n_steps + 1, n_columns)) for _ in range(3))
    for i in range(n_steps):
        w_em[i], w_w[i], angle_w[i] = state[W_EM], state[W_W], state[ANGLE_W]
        np.multiply(middle.rate, 0.5 * step, out=middle.state)
        np.add(middle.state, state, out=middle.state)
        middle.torque[:] = demand.torque[i]
        middle.brake[:] = demand.brake[i]
        middle.road[:] = demand.road[i]
        _evaluate(middle, functions)
        state += step * middle.rate
    w_em[-1], w_w[-1], angle_w[-1] = state[W_EM], state[W_W], state[ANGLE_W]
    return Motion(w_em, w_w, angle_w)


def _prepared(
    base: dict[str, Floats], start: tuple[Floats, Floats], parts: Sequence[tuple[slice, Parts]]
) -> tuple[Floats, dict[str, list[Part]]]:
    """Return the first state, with the own rows of the parts, and all functions by stage."""
    first_free: dict[int, int] = {}
    functions: dict[str, list[Part]] = {stage: [] for stage in STAGES}
    rolling: list[tuple[int, slice]] = []
    for columns, part in parts:
        row = first_free.get(columns.start, ANGLE_W + 1)
        first_free[columns.start] = row + len(part.rolling)
        rolling += [(row + i, columns) for i, rolls in enumerate(part.rolling) if rolls]
        for stage, function in part.bind(columns, row).items():
            functions[stage].append(function)
    n_rows = max(first_free.values(), default=ANGLE_W + 1)
    state = np.zeros((n_rows, start[0].size))
    state[W_EM], state[W_W], state[ANGLE_EM] = base["R"] * start[0], start[0], start[1]
    for row, columns in rolling:
        state[row, columns] = start[0][columns]
    return state, functions


def _middle(base: dict[str, Floats], state: Floats, step: float) -> StepMidpoint:
    """Return a middle with room for everything, and zero rates."""
    rows = [np.zeros(state.shape[1]) for _ in range(10)]
    return StepMidpoint(np.empty_like(state), np.zeros_like(state), state, base, step, *rows)


def _evaluate(middle: StepMidpoint, functions: dict[str, list[Part]]) -> None:
    """Write the rates at the middle; effects take part at their stages."""
    base, state, rate, step = middle.base, middle.state, middle.rate, middle.step
    w_em, w_w = state[W_EM], state[W_W]
    _run(functions["actuator"], middle)
    np.divide(w_em, base["R"], out=middle.upstream)
    _run(functions["upstream"], middle)
    speed = middle.upstream - w_w
    middle.stiffness[:] = base["k"]
    middle.remembered[:] = 0.0
    _run(functions["shaft"], middle)
    gap = middle.start[GAP]
    spring = middle.stiffness * (state[TWIST] - gap) + middle.remembered
    half = middle.stiffness * (0.5 * step)
    free = (base["c"] * speed + spring) / (base["c"] + half)
    closing = np.minimum(
        np.maximum(free, (-base["alpha"] - gap) / step), (base["alpha"] - gap) / step
    )
    np.subtract(speed, closing, out=middle.elastic)
    middle.shaft[:] = spring - half * closing + base["c"] * middle.elastic
    middle.reaction[:] = middle.shaft
    _run(functions["reaction"], middle)
    middle.friction[:] = base["b_em"] * w_em
    _run(functions["friction"], middle)
    sense = np.tanh(w_w / base["w_0"])
    middle.brake[:] *= sense
    rate[W_EM] = (middle.torque - middle.friction - middle.reaction / base["R"]) / base["J_em"]
    resistance = base["f0"] * sense + w_w * (base["b_w"] + base["cd2"] * np.abs(w_w))
    rate[W_W] = (middle.shaft - middle.brake - resistance - middle.road) / base["J_v"]
    rate[TWIST], rate[GAP], rate[ANGLE_EM], rate[ANGLE_W] = speed, closing, w_em, w_w
    _run(functions["memory"], middle)
    _run(functions["vehicle"], middle)


def _run(parts: list[Part], middle: StepMidpoint) -> None:
    for part in parts:
        part(middle)
