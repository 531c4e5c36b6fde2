"""Compiled: runs and batches in C where a compiler is there, by the interpreter where none is.

Both have the same bits. What did the work is told, with the reason where it is the interpreter.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from functools import cache, partial

from codegen.build import BuildError
from codegen.library import library_of
from codegen.stepper import CompiledStepper
from engine.batch import Batch, BatchResult
from engine.plan import why_not_planned
from engine.planned import PlannedRun
from engine.planned_batch import Planner
from engine.simulate import simulate
from engine.starting import programs_of
from engine.stimulus import resolved
from engine.trajectory import Trajectory
from engine.variants import run_variants
from language.experiment import Scenario, System
from language.missing import ToolMissing
from language.program import Program

LONG = 100_000
"""Steps and ticks from which on a run is compiled unasked: the interpreter takes seconds for them,
the compiler about one, once."""


def run(system: System, scenario: Scenario, compiled: bool | None = None) -> tuple[Trajectory, str]:
    """Return the trajectory of a run, and what carried it out, with the reason if not all in C.

    `compiled` takes C where it can; None does so for runs that are long.
    """
    scenario = resolved(system, scenario)
    programs = programs_of(system, scenario)
    count = _count(scenario, programs)
    if compiled is False or (compiled is None and count < LONG):
        why = "asked for" if compiled is False else f"{count} steps are too few to compile for"
        return simulate(system, scenario, programs=programs), f"interpreter: {why}"
    try:
        found, means = _in_c(system, scenario, programs)
    except (ToolMissing, BuildError, OSError) as error:
        found, means = None, str(error).splitlines()[0]
    if found:
        return found, means
    return simulate(system, scenario, programs=programs), f"interpreter: {means}"


def run_in_c(system: System, scenario: Scenario) -> tuple[Trajectory, str]:
    """Return the trajectory of a run by compiled C: whole, or block by block where that is not all.

    Raises ToolMissing, BuildError.
    """
    scenario = resolved(system, scenario)
    programs = programs_of(system, scenario)
    found, means = _in_c(system, scenario, programs)
    if found:
        return found, means
    found = simulate(system, scenario, CompiledStepper, programs=programs)
    return found, f"compiled, block by block: {means}"


def carried_out(system: System, scenario: Scenario, programs: Mapping[str, Program]) -> Trajectory:
    """Return the trajectory of a resolved scenario, in C where that is possible."""
    with suppress(ToolMissing, BuildError, OSError):
        found, _ = _in_c(system, scenario, programs)
        if found:
            return found
    return simulate(system, scenario, programs=programs)


def _in_c(
    system: System, scenario: Scenario, programs: Mapping[str, Program]
) -> tuple[Trajectory | None, str]:
    """Return a run in one call; block by block where that is not planned; None: it stopped."""
    why = why_not_planned(system, scenario, programs)
    if why:
        found = simulate(system, scenario, CompiledStepper, programs=programs)
        return found, f"compiled, block by block: {why}"
    build = partial(library_of, side_by_side=False)
    run = PlannedRun(system, scenario, programs, build).trajectory()
    return run, "compiled" if run else "it has to tell what happened"


def run_batch(batch: Batch, threads: int | None = None, least: int = 0) -> BatchResult:
    """Return what is kept of each variant of a batch: by C on all cores, or on so many threads.

    Variants that share a Program and have fewer than `least` steps in all are not compiled for.
    """
    return _carried_out(Planner(library_of, least), batch, threads)


def run_block(batch: Batch) -> BatchResult:
    """Return what is kept of each variant of a part of a study, which has one core.

    Parts that differ in numbers alone are planned once in a process.
    """
    return _carried_out(_planner(), batch, threads=1)


@cache
def _planner() -> Planner:
    return Planner(library_of, LONG)


def _carried_out(planner: Planner, batch: Batch, threads: int | None) -> BatchResult:
    try:
        return planner.planned(batch).carry_out(threads)
    except (ToolMissing, BuildError, OSError) as error:
        note = f"interpreter: {str(error).splitlines()[0]}"
        return BatchResult(**{**vars(run_variants(batch)), "note": note})


def _count(scenario: Scenario, programs: dict[str, Program]) -> int:
    """Return how many steps and ticks a run has."""
    assert scenario.horizon is not None
    return sum(int(scenario.horizon / program.major_step) for program in programs.values())
