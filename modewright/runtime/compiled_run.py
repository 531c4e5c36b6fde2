"""Compiled: runs and batches in C where a compiler is there, by the interpreter where none is.

Both have the same bits. What did the work is told, with the reason where it is the interpreter.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from functools import cache, partial

from codegen.simulator.compiled_stepper import CompiledStepper
from codegen.simulator.simulator_library import load_library
from codegen.toolchain.compiler import BuildError
from engine.batch.batch import Batch, BatchResult
from engine.batch.compiled_batch import CompiledBatchCache
from engine.batch.compiled_run import CompiledRun
from engine.batch.interpreted_batch import run_interpreted_batch
from engine.batch.run_plan import planning_obstacle
from engine.results.trajectory import Trajectory
from engine.simulation.instance_programs import programs_of
from engine.simulation.simulate import simulate
from engine.simulation.stimuli import resolve_recording
from language.ir.program import Program
from language.model.system import Scenario, System
from language.text.diagnostic import MissingToolError

COMPILE_THRESHOLD = 100_000
"""Steps and ticks from which on a run is compiled unasked: the interpreter takes seconds for them,
the compiler about one, once."""


def run_simulation(
    system: System, scenario: Scenario, compiled: bool | None = None
) -> tuple[Trajectory, str]:
    """Return the trajectory of a run, and what carried it out, with the reason if not all in C.

    `compiled` takes C where it can; None does so for runs that are long.
    """
    scenario = resolve_recording(system, scenario)
    programs = programs_of(system, scenario)
    count = _count_steps(scenario, programs)
    if compiled is False or (compiled is None and count < COMPILE_THRESHOLD):
        reason = "asked for" if compiled is False else f"{count} steps are too few to compile for"
        return simulate(system, scenario, programs=programs), f"interpreter: {reason}"
    try:
        trajectory, backend = _simulate_in_c(system, scenario, programs)
    except (MissingToolError, BuildError, OSError) as error:
        trajectory, backend = None, str(error).splitlines()[0]
    if trajectory:
        return trajectory, backend
    return simulate(system, scenario, programs=programs), f"interpreter: {backend}"


def run_in_c(system: System, scenario: Scenario) -> tuple[Trajectory, str]:
    """Return the trajectory of a run by compiled C: whole, or block by block where that is not all.

    Raises ToolMissing, BuildError.
    """
    scenario = resolve_recording(system, scenario)
    programs = programs_of(system, scenario)
    trajectory, reason = _simulate_in_c(system, scenario, programs)
    if trajectory:
        return trajectory, reason
    trajectory = simulate(system, scenario, CompiledStepper, programs=programs)
    return trajectory, f"compiled, block by block: {reason}"


def simulate_resolved(
    system: System, scenario: Scenario, programs: Mapping[str, Program]
) -> Trajectory:
    """Return the trajectory of a resolved scenario, in C where that is possible."""
    with suppress(MissingToolError, BuildError, OSError):
        trajectory, _ = _simulate_in_c(system, scenario, programs)
        if trajectory:
            return trajectory
    return simulate(system, scenario, programs=programs)


def _simulate_in_c(
    system: System, scenario: Scenario, programs: Mapping[str, Program]
) -> tuple[Trajectory | None, str]:
    """Return a run in one call; block by block where that is not planned; None: it stopped."""
    reason = planning_obstacle(system, scenario, programs)
    if reason:
        trajectory = simulate(system, scenario, CompiledStepper, programs=programs)
        return trajectory, f"compiled, block by block: {reason}"
    build = partial(load_library, simd_batch=False)
    run = CompiledRun(system, scenario, programs, build).trajectory()
    return run, "compiled" if run else "it has to tell what happened"


def run_batch(batch: Batch, threads: int | None = None, min_steps: int = 0) -> BatchResult:
    """Return what is kept of each variant of a batch: by C on all cores, or on so many threads.

    Variants that share a Program and have fewer than `min_steps` steps in all are not compiled for.
    """
    return _run_planned(CompiledBatchCache(load_library, min_steps), batch, threads)


def run_block(batch: Batch) -> BatchResult:
    """Return what is kept of each variant of a part of a study, which has one core.

    Parts that differ in numbers alone are planned once in a process.
    """
    return _run_planned(_shared_planner(), batch, threads=1)


@cache
def _shared_planner() -> CompiledBatchCache:
    return CompiledBatchCache(load_library, COMPILE_THRESHOLD)


def _run_planned(planner: CompiledBatchCache, batch: Batch, threads: int | None) -> BatchResult:
    try:
        return planner.get_or_compile(batch).run(threads)
    except (MissingToolError, BuildError, OSError) as error:
        note = f"interpreter: {str(error).splitlines()[0]}"
        return BatchResult(**{**vars(run_interpreted_batch(batch)), "note": note})


def _count_steps(scenario: Scenario, programs: dict[str, Program]) -> int:
    """Return how many steps and ticks a run has."""
    assert scenario.horizon is not None
    return sum(int(scenario.horizon / program.major_step) for program in programs.values())
