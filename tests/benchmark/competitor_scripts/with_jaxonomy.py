"""With jaxonomy: a leaf system with a mode, a zero crossing for each transition, compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import jaxonomy
import numpy as np
from jaxonomy.simulation import SimulatorOptions

from tests.benchmark.driveline import rates_and_guards
from tests.benchmark.manoeuvre import Manoeuvre
from tests.benchmark.reference_solution import Solution

MOST_EVENTS = 100
GAP, DRIVE, COAST = 0, 1, 2
SIGNS = {GAP: 0, DRIVE: 1, COAST: -1}
OPTIONS = SimulatorOptions(
    rtol=1e-6, atol=1e-6, max_minor_step_size=0.01, max_major_step_length=0.01, max_major_steps=2000
)


class Driveline(jaxonomy.LeafSystem):  # type: ignore[misc]
    """The plant; its discrete state counts the events and keeps their times [s] and modes."""

    def __init__(self, case: Manoeuvre) -> None:
        super().__init__(name="plant")
        contact, gap, free = rates_and_guards(case)
        alpha = case.values()["alpha"]

        def rates(time: Any, state: Any, **p: Any) -> Any:
            y = state.continuous_state
            shut, open_ = jnp.stack(contact(y, p["T_em"])), jnp.stack(gap(y, p["T_em"]))
            return jnp.where(state.mode == GAP, open_, shut)

        self.declare_dynamic_parameter("T_em", float(case.torques[0]))
        start = jnp.array([float(value) for value in case.start()])
        self.declare_continuous_state(default_value=start, ode=rates)
        self.declare_discrete_state(default_value=jnp.zeros(1 + 2 * MOST_EVENTS))
        self.declare_default_mode(DRIVE)
        for old, new, guard in (
            (DRIVE, GAP, free),
            (COAST, GAP, lambda y: -free(y)),
            (GAP, DRIVE, lambda y: alpha - y[3]),
            (GAP, COAST, lambda y: alpha + y[3]),
        ):
            self._declare(old, new, guard, alpha)

    def _declare(self, old: int, new: int, guard: Callable[[Any], Any], alpha: float) -> None:
        def reset(time: Any, state: Any, **p: Any) -> Any:
            kept, sign = state.discrete_state, SIGNS[new]
            count = kept[0].astype(int)
            kept = kept.at[1 + 2 * count].set(time).at[2 + 2 * count].set(sign)
            state = state.with_discrete_state(kept.at[0].add(1.0))
            if new != GAP:
                y = state.continuous_state
                state = state.with_continuous_state(y.at[3].set(sign * alpha))
            return state

        self.declare_zero_crossing(
            lambda time, state, **p: guard(state.continuous_state),
            reset,
            start_mode=old,
            end_mode=new,
            direction="positive_then_non_positive",
            name=f"{old}_to_{new}",
        )


def prepared(case: Manoeuvre) -> Callable[[], Solution]:
    """Return what runs a manoeuvre once, compiled."""
    system = Driveline(case)
    simulator = jaxonomy.Simulator(system, options=OPTIONS)
    advance = jax.jit(lambda time, context: simulator.advance_to(time, context).context)
    first = system.create_context()

    def run() -> Solution:
        context = first
        for stop, torque in zip((case.step_ms, case.horizon_ms), case.torques, strict=True):
            context = advance(stop / 1000, context.with_parameter("T_em", float(torque)))
        kept = np.asarray(context.discrete_state)
        count = int(kept[0])
        pairs = zip(kept[1 : 1 + 2 * count : 2], kept[2 : 2 + 2 * count : 2], strict=True)
        events = tuple((float(time), int(mode)) for time, mode in pairs)
        return Solution(events, (case.horizon_ms,), np.asarray(context.continuous_state[:1]))

    return run
