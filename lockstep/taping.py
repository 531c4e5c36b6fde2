"""Taping: a system is simulated, and what each of its instances read and carried is kept."""

from __future__ import annotations

from engine.interpreter.interpreter import Stepper
from engine.results.trajectory import Trajectory
from engine.simulation.simulate import simulate
from language.ir.program import Program
from language.model.system import Scenario, System
from lockstep.compare import TickLog


def record_ticks(system: System, scenario: Scenario) -> tuple[Trajectory, dict[str, TickLog]]:
    """Simulate; return the trajectory and a tape of each instance by name."""
    logs: dict[str, TickLog] = {}

    def ticked(name: str, used: Program, stepper: Stepper) -> None:
        if name not in logs:
            logs[name] = TickLog(used, name=name, start=float(system.instances[name].offset))
        logs[name].record_tick(stepper)

    return simulate(system, scenario, on_tick=ticked), logs
