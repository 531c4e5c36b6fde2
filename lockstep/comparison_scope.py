"""Comparison scope: which parts of a simulation were compared with C, and why others were not."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from engine.results.trajectory import Trajectory
from engine.simulation.instance_programs import programs_of
from engine.simulation.stimuli import resolve_recording
from language.ir.program import Program
from language.model.system import Scenario, System
from lockstep.comparison import Verdict, skipped_verdict


def add_notes(
    verdicts: Sequence[Verdict], system: System, scenario: Scenario, trajectory: Trajectory
) -> list[Verdict]:
    """Return the verdicts with notes, and a skipped verdict for each other instance of the system.

    Given verdicts keep their order and come first. A continuous instance that was compared up to a
    part of the horizon gets a note with that time, unless the simulation stopped.
    """
    scenario = resolve_recording(scenario)
    verdict_by_instance = {verdict.name: verdict for verdict in verdicts}
    for name, program in programs_of(system, scenario).items():
        if name not in verdict_by_instance:
            verdict_by_instance[name] = skipped_verdict(name, program, _skip_reason(program))
        elif program.period is None and trajectory.stopped is None:
            verdict_by_instance[name] = _add_end_note(verdict_by_instance[name], program, scenario)
    return list(verdict_by_instance.values())


def _skip_reason(program: Program) -> str:
    """Return the reason why an instance was not compared."""
    if "step" not in program.blocks:
        reason = "not compared: an input varies inside its major steps, which C cannot be given"
        return f"{reason}; `steps` and tables with `hold: previous` can be"
    return "not compared: nothing happened to it at its own pace"


def _add_end_note(verdict: Verdict, program: Program, scenario: Scenario) -> Verdict:
    """Return the verdict with a note if only a part of the horizon was compared.

    The comparison ends at the first outside event inside a major step.
    """
    assert scenario.horizon is not None
    steps = scenario.horizon // program.major_step + 1
    if verdict.ticks >= steps:
        return verdict
    end = float((verdict.ticks - 1) * program.major_step)
    note = f"compared up to {end:.9g} s: then an input steps, or something reads or samples it, "
    note += f"between two of its major steps of {float(program.major_step):.9g} s"
    return dataclasses.replace(verdict, note=note)
