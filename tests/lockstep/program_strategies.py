"""Random sampled Programs as hypothesis strategies, and the inputs of their ticks.

Each equation is an expression of its own, so that one compilation compares many of them.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TypeVar

from hypothesis import strategies as st

from engine.interpreter.interpreter import Interpreter
from language.ir.number_type import NumberType
from language.ir.ops import (
    Assign,
    Block,
    Branch,
    Compare,
    Count,
    Expr,
    FaultBit,
    Item,
    Loop,
    Op,
    Ref,
    RunBlock,
    Store,
    Value,
    integer,
    multiply,
    real,
    subtract,
)
from language.ir.program import Program
from lockstep.tick_log import TickLog
from tests.lockstep.expression_strategies import ANY, FINITE, Draw, Scope, reals, truths
from tests.lockstep.program_template import (
    CONDITIONS,
    EQUATIONS,
    INPUTS,
    MODES,
    SIZE,
    STATES,
    assemble_program,
)

DEPTH = 3
LARGEST = (2.0 - 2.0**-23) * 2.0**127
"""The largest float32: a literal beyond it is refused before there is a Program."""
TUNED = Scope(tuple(map(Ref, ("constant.a", "constant.b", "calibration.p"))))
"""What `derive` may read."""
PLACE = Scope(
    (
        *TUNED.reals,
        Ref("derived.d"),
        *(Ref(f"input.{name}") for name in INPUTS * 2),
        *(Ref(f"state.{name}") for name in STATES),
        Ref("before.u"),
    ),
    (Ref("input.go"), Ref("is_new.u"), Ref("memory.started")),
    ((Ref("memory.mode"), len(MODES) - 1), (Ref("timer.rest"), 3)),
)
"""What the blocks of a tick may read."""
WIDE = Scope(
    (*PLACE.reals, *(Ref(f"equation.r{k}") for k in range(0, EQUATIONS, 6))),
    (*PLACE.truths, Ref("equation.q0"), Ref("equation.q1")),
    PLACE.counters,
)
"""What they may read once the equations are known."""

Tick = dict[str, float | bool]
Part = TypeVar("Part")


def narrowed(part: Part, number: NumberType) -> Part:
    """Return a number, or operations, whose literals are within the range of a type."""
    if number == "float64":
        return part
    if isinstance(part, float):
        return max(-LARGEST, min(LARGEST, part))  # type: ignore[return-value]
    if isinstance(part, tuple):
        return tuple([narrowed(item, number) for item in part])  # type: ignore[return-value]
    if dataclasses.is_dataclass(part) and not isinstance(part, type):
        fields = [field.name for field in dataclasses.fields(part)]
        changed = {name: narrowed(getattr(part, name), number) for name in fields}
        return dataclasses.replace(part, **changed)
    return part


@st.composite
def programs(draw: Draw, number: NumberType = "float64") -> Program:
    """Return a Program of three modes."""
    blocks = _Blocks(draw)
    made: dict[str, Block] = {"table": blocks.table(), "mix": blocks.mix()}
    for place, mode in enumerate(MODES):
        made[f"advance_{mode}"] = blocks.advance(mode)
        made[f"equations_{mode}"] = blocks.equations(place)
        made[f"jump_{mode}"] = blocks.jump(place)
        if mode != "move":
            made[f"update_{mode}"] = blocks.together("next")
    made["retain_inputs"] = (Assign("before.u", Ref("input.u")),)
    made["start"] = blocks.start()
    made["derive"] = blocks.derive()
    a, b, p = (narrowed(draw(FINITE), number) for _ in range(3))
    return assemble_program(
        {name: narrowed(block, number) for name, block in made.items()}, (a, b, p), number
    )


@st.composite
def ticks(draw: Draw, count: int = 6) -> list[Tick]:
    """Return the inputs of some ticks, special values among them."""
    found: list[Tick] = []
    for _ in range(count):
        tick: Tick = {f"input.{name}": draw(ANY) for name in INPUTS}
        tick["input.go"], tick["is_new.u"] = draw(st.booleans()), draw(st.booleans())
        found.append(tick)
    return found


def record_ticks(program: Program, inputs: list[Tick]) -> TickLog:
    """Return what the interpreter does with some inputs."""
    stepper, tape = Interpreter(program), TickLog(program, program.name)
    for tick in inputs:
        for name, value in tick.items():
            stepper.set(name, value)
        stepper.run("step")
        tape.record_tick(stepper)
    return tape


@dataclass(frozen=True)
class _Blocks:
    """Random blocks: one method per kind."""

    draw: Draw

    def some(self, scope: Scope = PLACE) -> Expr:
        found: Expr = self.draw(reals(scope, DEPTH))
        return found

    def either(self, scope: Scope = PLACE) -> Expr:
        found: Expr = self.draw(truths(scope, DEPTH))
        return found

    def derive(self) -> Block:
        return (
            Assign("derived.c", multiply(Ref("calibration.p"), self.some(TUNED))),
            Assign("derived.d", self.some(TUNED.with_reals(Ref("derived.c")))),
        )

    def start(self) -> Block:
        known = TUNED.with_reals(Ref("input.u"), Ref("derived.c"))
        return (
            *(Assign(f"state.{name}", self.some(known)) for name in STATES),
            Assign("memory.mode", integer(0)),
            Assign("memory.started", Value(True)),
        )

    def advance(self, mode: str) -> Block:
        odd = Branch(self.either(), (FaultBit(f"odd_{mode}"),))
        return (*(Assign(f"state.{name}", self.some()) for name in STATES), odd)

    def table(self) -> Block:
        """Fill an array, change it by its other end, add it up by a loop within a loop."""
        row, turn = Ref("work.row"), Ref("work.turn")
        counted = Scope(PLACE.reals, PLACE.truths, ((row, SIZE - 1), *PLACE.counters))
        local, item = Ref("work.local"), Item("work.list", subtract(integer(SIZE - 1), row))
        inner = Scope((*PLACE.reals, Ref("work.sum"), Item("work.list", turn)), PLACE.truths)
        change = Store("work.list", row, self.some(counted.with_reals(local)))
        add_up = Loop(SIZE, "work.turn", (Assign("work.sum", self.some(inner)),))
        seldom = Assign("equation.row", self.some(counted.with_reals(item)))
        return (
            Loop(SIZE, "work.row", (Store("work.list", row, self.some(counted)),)),
            Loop(
                SIZE,
                "work.row",
                (
                    Assign("work.local", self.some(counted.with_reals(item))),
                    Branch(self.either(counted), (change,)),
                ),
            ),
            Assign("work.sum", real(-0.0)),
            Loop(2, "work.row", (add_up, Branch(self.either(counted), (seldom,)))),
            Assign("equation.total", Ref("work.sum")),
        )

    def mix(self) -> Block:
        """All equations that every mode has, after locals and a block within this one."""
        locals_: Block = (
            Assign("work.local", self.some()),
            Assign("work.flag", self.either()),
        )
        known = PLACE.with_reals(
            Ref("work.local"), Item("work.list", integer(1)), Ref("equation.total")
        )
        known = Scope(known.reals, (*known.truths, Ref("work.flag")), known.counters)
        reals_ = [Assign(f"equation.r{k}", self.some(known), f"r{k}") for k in range(EQUATIONS)]
        truths_ = [Assign(f"equation.q{k}", self.either(known), f"q{k}") for k in range(CONDITIONS)]
        return (RunBlock("table"), *locals_, *reals_, *truths_)

    def equations(self, number: int) -> Block:
        own: list[Op] = [Assign(f"equation.m{k}", self.some(WIDE)) for k in range(2)]
        return (RunBlock("mix"), *own) if number else (*own, RunBlock("mix"))

    def jump(self, number: int) -> Block:
        """A wait with resets first, then a jump at once; each leads to another mode."""
        timer, limit = f"timer.{MODES[number]}", self.draw(st.integers(2, 4))
        waited = Compare(">", Ref(timer), integer(limit - 1))
        first = (*self.together("reset"), *_leave(number, timer, 1))
        second = Branch(self.either(WIDE), _leave(number, timer, 2))
        return (Count(timer, self.either(WIDE), limit), Branch(waited, first, (second,)))

    def together(self, verb: str) -> Block:
        """Assignments of all states from the values of before."""
        first = [Assign(f"work.{verb}_{name}", self.some(WIDE)) for name in STATES]
        return (*first, *(Assign(f"state.{name}", Ref(f"work.{verb}_{name}")) for name in STATES))


def _leave(number: int, timer: str, way: int) -> Block:
    return (
        Assign(timer, integer(0)),
        Assign("memory.mode", integer((number + way) % len(MODES))),
        Assign("memory.fired", integer(2 * number + way)),
    )
