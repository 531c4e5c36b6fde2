"""Running: a random spec in the engine, kept on a tape that C is compared with."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from random import Random

from engine.execution.event_loop import ContinuousRun, SimulationStopped
from engine.interpreter.interpreter import Interpreter
from engine.results.sampled_run import Event
from language.ir.program import Program
from lockstep.tick_log import TickLog
from tests.lockstep.random_specs.spec import Spec
from tests.lockstep.random_specs.stimulus import Tick, ticks

Look = Callable[[Interpreter], None]


def nothing(seen: object) -> None:
    """Look at nothing."""


def record_ticks(
    spec: Spec,
    program: Program,
    count: int,
    run: Program | None = None,
    look: Look = nothing,
    log: Callable[[Event], None] = nothing,
) -> TickLog:
    """Return the tape of some ticks or major steps, fewer if the run is stopped.

    `run` is what the interpreter runs in place of the Program; `look` sees it after each tick,
    `log` each event of a continuous automaton.
    """
    stepper, tape = Interpreter(run or program), TickLog(program, program.name)
    inputs = inputs_of(spec, program, stepper, count)
    if program.period is None:
        flow = ContinuousRun(program.name, program, stepper, log)
        _flow(flow, inputs, count, partial(_seen, tape, stepper, look))
        return tape
    for _ in inputs:
        stepper.run("step")
        _seen(tape, stepper, look)
    return tape


def inputs_of(spec: Spec, program: Program, stepper: Interpreter, count: int) -> Iterator[Tick]:
    """Set the inputs of each tick, the same each time."""
    flags = [v.name for v in program.variables if v.name.startswith("is_new.")]
    draw, is_sampled = Random(f"inputs of {spec.name}"), program.period is not None
    for tick in ticks(draw, spec, count, special=is_sampled):
        for name, value in tick.items():
            if stepper.has(name):
                stepper.set(name, value)
        for name in flags:
            stepper.set(name, bool(tick["input.go"]))
        yield tick


def _seen(tape: TickLog, stepper: Interpreter, look: Look) -> None:
    tape.record_tick(stepper)
    look(stepper)


def _flow(
    run: ContinuousRun, inputs: Iterator[Tick], count: int, stepped: Callable[[], None]
) -> None:
    """As engine/simulation/simulate.py does: flow to the end of a step, new inputs, jumps."""
    run.on_step = stepped
    try:
        for number in range(count):
            if number:
                run.flow_to(number * run.program.major_step)
            next(inputs)
            if not number:
                run.start()
            run.settle()
            run.end_step()
    except SimulationStopped:
        return
