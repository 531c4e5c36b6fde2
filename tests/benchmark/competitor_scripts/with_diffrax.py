"""With diffrax: one compiled loop over the modes, each ended by an event that is located."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix

from tests.benchmark.driveline import rates_and_guards
from tests.benchmark.manoeuvre import Manoeuvre
from tests.benchmark.reference_solution import Solution

MOST_EVENTS = 100
NUDGE = 1e-12
"""Into the gap [rad]: a guard that is zero at the start of a flow would end it at once."""
TOLERANCE = 1e-6
LONGEST = 0.01

jax.config.update("jax_enable_x64", True)


def prepared(case: Manoeuvre) -> Callable[[], Solution]:
    """Return what runs a manoeuvre once, compiled."""
    run = jax.jit(_loop(case))
    start = jnp.array([float(value) for value in case.start()])
    torques = tuple(float(value) for value in case.torques)

    def solution() -> Solution:
        y, times, modes, count = jax.block_until_ready(run(start, torques))
        found = zip(np.asarray(times)[: int(count)], np.asarray(modes)[: int(count)], strict=True)
        events = tuple((float(time), int(mode)) for time, mode in found)
        return Solution(events, (case.horizon_ms,), np.asarray(y[:1]))

    return solution


def _loop(case: Manoeuvre) -> Callable[..., Any]:
    piece_of, alpha = _piece_of(case), case.values()["alpha"]

    def leg(stop: float, torque: Any, carried: Any) -> Any:
        def flow(carried: Any) -> Any:
            t, y, mode, times, modes, count = carried
            end, y = piece_of(t, stop, y, mode, torque)
            is_event = end < stop
            side = jnp.where(y[3] > 0, 1, -1)
            hit = jnp.where(mode == 0, side, 0)
            moved = y.at[3].set(jnp.where(mode == 0, side * alpha, y[3] - side * NUDGE))
            times = jnp.where(is_event, times.at[count].set(end), times)
            modes = jnp.where(is_event, modes.at[count].set(hit), modes)
            y, mode = jnp.where(is_event, moved, y), jnp.where(is_event, hit, mode)
            return end, y, mode, times, modes, count + is_event

        return jax.lax.while_loop(lambda one: one[0] < stop, flow, carried)

    def run(start: Any, torques: Any) -> Any:
        empty = jnp.zeros(MOST_EVENTS)
        count = jnp.array(0)
        carried = (jnp.array(0.0), start, jnp.array(1), empty, empty.astype(int), count)
        for stop, torque in zip((case.step_ms, case.horizon_ms), torques, strict=True):
            carried = leg(stop / 1000, torque, carried)
        _, y, _, times, modes, count = carried
        return y, times, modes, count

    return run


def _piece_of(case: Manoeuvre) -> Callable[..., Any]:
    """Return what solves a mode until its guard or a time ends it: that time, and the states."""
    contact, gap, free = rates_and_guards(case)
    alpha = case.values()["alpha"]

    def rates(t: Any, y: Any, args: Any) -> Any:
        mode, torque = args
        shut, open_ = jnp.stack(contact(y, torque)), jnp.stack(gap(y, torque))
        return jnp.where(mode == 0, open_, shut)

    def guard(t: Any, y: Any, args: Any, **rest: Any) -> Any:
        mode, _ = args
        return jnp.where(mode == 0, alpha - jnp.abs(y[3]), mode * free(y))

    term, solver = diffrax.ODETerm(rates), diffrax.Dopri5()
    event = diffrax.Event(guard, optimistix.Bisection(1e-12, 1e-12))
    steps = diffrax.PIDController(rtol=TOLERANCE, atol=TOLERANCE, dtmax=LONGEST)
    options: dict[str, Any] = {"stepsize_controller": steps, "event": event, "max_steps": 4000}

    def piece(t: Any, stop: float, y: Any, mode: Any, torque: Any) -> tuple[Any, Any]:
        done = diffrax.diffeqsolve(term, solver, t, stop, 1e-3, y, (mode, torque), **options)
        return done.ts[-1], done.ys[-1]

    return piece
