"""Running: a random spec in the interpreter, kept on a tape that C is compared with."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from random import Random

from engine.interpreter import Interpreter
from language.program import Program
from lockstep.compare import Tape
from tests.lockstep.chance.spec import Spec
from tests.lockstep.chance.stimulus import Tick, ticks

Look = Callable[[Interpreter], None]


def taped(spec: Spec, program: Program, count: int, run: Program | None = None) -> Tape:
    """Return the tape of some ticks; `run` is what the interpreter runs in place of the Program."""
    return tape_of(program, Interpreter(run or program), inputs_of(spec, count))


def inputs_of(spec: Spec, count: int) -> Iterable[Tick]:
    """Return the inputs of a spec, the same each time."""
    return ticks(Random(f"inputs of {spec.name}"), spec, count)


def tape_of(
    program: Program, stepper: Interpreter, inputs: Iterable[Tick], look: Look | None = None
) -> Tape:
    """Return the tape of a stepper; `look` sees it after each tick."""
    tape = Tape(program, program.name)
    flags = [v.name for v in program.variables if v.name.startswith("is_new.")]
    for tick in inputs:
        for name, value in tick.items():
            if stepper.has(name):
                stepper.set(name, value)
        for name in flags:
            stepper.set(name, bool(tick["input.go"]))
        stepper.run("step")
        tape.record(stepper)
        if look:
            look(stepper)
    return tape
