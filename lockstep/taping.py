"""Taping: a system is simulated, and what each of its instances read and carried is kept."""

from __future__ import annotations

from engine.interpreter import Stepper
from engine.simulate import simulate
from engine.trajectory import Trajectory
from language.experiment import Scenario, System
from language.program import Program
from lockstep.compare import Tape


def taped(system: System, scenario: Scenario) -> tuple[Trajectory, dict[str, Tape]]:
    """Simulate; return the trajectory and a tape of each instance by name."""
    tapes: dict[str, Tape] = {}

    def ticked(name: str, used: Program, stepper: Stepper) -> None:
        if name not in tapes:
            tapes[name] = Tape(used, name=name, start=float(system.instances[name].offset))
        tapes[name].record(stepper)

    return simulate(system, scenario, ticked=ticked), tapes
