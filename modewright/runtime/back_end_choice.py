"""Back end choice: run simulations and batches in C, or in the interpreter without a compiler.

Both have the same bits. The results name the back end, with the reason for the interpreter.
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
"""Number of steps and ticks above which a run is compiled by default.

The interpreter takes seconds for them, the compiler about one second once.
"""


def run_simulation(
    system: System, scenario: Scenario, compiled: bool | None = None
) -> tuple[Trajectory, str]:
    """Return the trajectory of a run and the name of the back end, with the reason if not compiled.

    `compiled` uses C if possible and False the interpreter; None uses C from COMPILE_THRESHOLD
    steps on. Without a compiler, after a failed build and for a run that stops in C the interpreter
    runs it. The name is `compiled`, `compiled, block by block: reason` or `interpreter: reason`.
    """
    scenario = resolve_recording(scenario)
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
    """Return the trajectory of a run in compiled C, and how it was run.

    The text is `compiled`, or `compiled, block by block: reason` for a run that cannot be planned
    as a whole or that stops. Raises MissingToolError and BuildError.
    """
    scenario = resolve_recording(scenario)
    programs = programs_of(system, scenario)
    trajectory, reason = _simulate_in_c(system, scenario, programs)
    if trajectory:
        return trajectory, reason
    trajectory = simulate(system, scenario, CompiledStepper, programs=programs)
    return trajectory, f"compiled, block by block: {reason}"


def simulate_resolved(
    system: System, scenario: Scenario, programs: Mapping[str, Program]
) -> Trajectory:
    """Return the trajectory of a scenario whose recording was resolved, in C if possible.

    `programs` are the Programs of the instances. Without a compiler, after a failed build and for a
    run that stops in C the interpreter runs it; the result has the same bits.
    """
    with suppress(MissingToolError, BuildError, OSError):
        trajectory, _ = _simulate_in_c(system, scenario, programs)
        if trajectory:
            return trajectory
    return simulate(system, scenario, programs=programs)


def _simulate_in_c(
    system: System, scenario: Scenario, programs: Mapping[str, Program]
) -> tuple[Trajectory | None, str]:
    """Return the trajectory in C and a note; None as trajectory if the planned run stopped.

    A system that cannot be planned as a whole is run block by block.
    """
    reason = planning_obstacle(system, scenario, programs)
    if reason:
        trajectory = simulate(system, scenario, CompiledStepper, programs=programs)
        return trajectory, f"compiled, block by block: {reason}"
    build = partial(load_library, simd_batch=False)
    run = CompiledRun(system, scenario, programs, build).trajectory()
    return run, "compiled" if run else "the run stopped, and C does not report the reason"


def run_batch(batch: Batch, threads: int | None = None, min_steps: int = 0) -> BatchResult:
    """Return the results of a batch, in C on `threads` threads (None: all cores).

    Batches with fewer than `min_steps` steps in total are interpreted, as are those that cannot be
    compiled; then `note` of the result has the reason.
    """
    return _run_planned(CompiledBatchCache(load_library, min_steps), batch, threads)


def run_block(batch: Batch) -> BatchResult:
    """Return the results of a part of a study, in C on one core.

    Compiled plans are shared in a process. Parts with fewer than COMPILE_THRESHOLD steps and those
    that cannot be compiled are interpreted.
    """
    return _run_planned(_shared_planner(), batch, threads=1)


@cache
def _shared_planner() -> CompiledBatchCache:
    """Return the cache of plans of this process."""
    return CompiledBatchCache(load_library, COMPILE_THRESHOLD)


def _run_planned(planner: CompiledBatchCache, batch: Batch, threads: int | None) -> BatchResult:
    """Return the results of a batch; the interpreter runs it if it cannot be compiled."""
    try:
        return planner.get_or_compile(batch).run(threads)
    except (MissingToolError, BuildError, OSError) as error:
        note = f"interpreter: {str(error).splitlines()[0]}"
        return BatchResult(**{**vars(run_interpreted_batch(batch)), "note": note})


def _count_steps(scenario: Scenario, programs: dict[str, Program]) -> int:
    """Return the number of major steps and ticks of a run."""
    assert scenario.horizon is not None
    return sum(int(scenario.horizon / program.major_step) for program in programs.values())
