"""Random sampled Programs as data, with the entries and the blocks that language/sampled.py gives.

Each equation is an expression of its own, so that one compilation compares many of them.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

from hypothesis import strategies as st

from engine.interpreter import Interpreter
from language.program import (
    Assign,
    Block,
    Branch,
    Choose,
    Compare,
    Constant,
    Count,
    Expr,
    FaultBit,
    Item,
    Loop,
    ModeInfo,
    Op,
    Program,
    Ref,
    Run,
    Store,
    TransitionInfo,
    Value,
    Variable,
    Wire,
    real,
    subtract,
    whole,
)
from language.wiring import finished
from lockstep.compare import Tape
from tests.lockstep.expressions import ANY, FINITE, Draw, Scope, reals, truths

PERIOD = Fraction(1, 100)
MODES = ("rest", "move", "stop")
INPUTS = ("u", "v", "w")
STATES = ("x", "y")
EQUATIONS = 24
CONDITIONS = 10
DEPTH = 3
SIZE = 4
"""Length of the array `work.list`."""

CONSTANTS = Scope(tuple(map(Ref, ("constant.a", "constant.b", "calibration.p", "derived.d"))))
"""What the blocks of a tick may read; `wide` where the equations are known too."""
PLACE = Scope(
    (
        *CONSTANTS.reals,
        *(Ref(f"input.{name}") for name in INPUTS * 2),
        *(Ref(f"state.{name}") for name in STATES),
        Ref("before.u"),
    ),
    (Ref("input.go"), Ref("is_new.u"), Ref("memory.started")),
    ((Ref("memory.mode"), len(MODES) - 1), (Ref("timer.rest"), 3)),
)
WIDE = Scope(
    (*PLACE.reals, *(Ref(f"equation.r{k}") for k in range(0, EQUATIONS, 6))),
    (*PLACE.truths, Ref("equation.q0"), Ref("equation.q1")),
    PLACE.counters,
)


@st.composite
def programs(draw: Draw) -> Program:
    """Return a Program of three modes."""

    def some(scope: Scope = PLACE, depth: int = DEPTH) -> Expr:
        found: Expr = draw(reals(scope, depth))
        return found

    def either(scope: Scope = PLACE) -> Expr:
        found: Expr = draw(truths(scope, DEPTH))
        return found

    blocks: dict[str, Block] = {"table": _table(some, either), "mix": _mix(some, either)}
    for number, mode in enumerate(MODES):
        blocks[f"advance_{mode}"] = (
            *(Assign(f"state.{name}", some()) for name in STATES),
            Branch(either(), (FaultBit(f"odd_{mode}"),)),
        )
        own: Block = tuple(Assign(f"equation.m{k}", some(WIDE)) for k in range(2))
        blocks[f"equations_{mode}"] = (Run("mix"), *own) if number else (*own, Run("mix"))
        blocks[f"jump_{mode}"] = _jump(number, some, either, draw)
        if number != 1:
            blocks[f"update_{mode}"] = _together("next", [(name, some(WIDE)) for name in STATES])
    blocks["remember"] = (Assign("before.u", Ref("input.u")),)
    blocks["start"] = (
        *(Assign(f"state.{name}", some(CONSTANTS.plus(Ref("input.u")))) for name in STATES),
        Assign("memory.mode", whole(0)),
        Assign("memory.started", Value(True)),
    )
    fixed = Scope(CONSTANTS.reals[:3])
    blocks["derive"] = (
        Assign("derived.c", some(fixed)),
        Assign("derived.d", some(fixed.plus(Ref("derived.c")))),
    )
    values = [draw(FINITE) for _ in range(3)]
    return program_of({**blocks, **_entries()}, values)


def _table(some: Callable[..., Expr], either: Callable[..., Expr]) -> Block:
    """Fill an array, change it from its end, add it up in a loop within a loop."""
    row, turn = Ref("work.row"), Ref("work.turn")
    counted = Scope(PLACE.reals, PLACE.truths, ((row, SIZE - 1), *PLACE.counters))
    item = Item("work.list", subtract(whole(SIZE - 1), row))
    inner = Scope((*PLACE.reals, Ref("work.sum"), Item("work.list", turn)), PLACE.truths)
    fill: Block = (Store("work.list", row, some(counted)),)
    change: Block = (
        Assign("work.local", some(counted.plus(item))),
        Branch(either(counted), (Store("work.list", row, some(inner_of(counted))),)),
    )
    add_up: Block = (
        Loop(SIZE, "work.turn", (Assign("work.sum", some(inner)),)),
        Branch(either(counted), (Assign("equation.row", some(inner_of(counted).plus(item))),)),
    )
    return (
        Loop(SIZE, "work.row", fill),
        Loop(SIZE, "work.row", change),
        Assign("work.sum", real(-0.0)),
        Loop(2, "work.row", add_up),
        Assign("equation.total", Ref("work.sum")),
    )


def inner_of(scope: Scope) -> Scope:
    """Return the scope with the local that its block has set."""
    return scope.plus(Ref("work.local")) if scope.counters[0][0] == Ref("work.none") else scope


def _mix(some: Callable[..., Expr], either: Callable[..., Expr]) -> Block:
    """Set all equations; locals, and a block within a block."""
    ops: list[Op] = [Run("table"), Assign("work.local", some()), Assign("work.flag", either())]
    known = PLACE.plus(Ref("work.local"), Item("work.list", whole(1)), Ref("equation.total"))
    known = Scope(known.reals, (*known.truths, Ref("work.flag")), known.counters)
    ops += [Assign(f"equation.r{k}", some(known), f"key.r{k}") for k in range(EQUATIONS)]
    ops += [Assign(f"equation.q{k}", either(known), f"key.q{k}") for k in range(CONDITIONS)]
    return tuple(ops)


def _jump(number: int, some: Callable[..., Expr], either: Callable[..., Expr], draw: Draw) -> Block:
    """A wait with resets before a jump at once, both to another mode."""
    timer = f"timer.{MODES[number]}"
    limit = draw(st.integers(2, 4))
    waited = Compare(">", Ref(timer), whole(limit - 1))
    leave: Block = (Assign(timer, whole(0)), Assign("memory.mode", whole((number + 1) % 3)))
    first = (
        *_together("reset", [(name, some(WIDE)) for name in STATES]),
        *leave,
        Assign("memory.fired", whole(2 * number + 1)),
    )
    second = (*leave[:1], Assign("memory.mode", whole((number + 2) % 3)))
    fired = Assign("memory.fired", whole(2 * number + 2))
    other: Block = (Branch(either(WIDE), (*second, fired)),)
    return (Count(timer, either(WIDE), limit), Branch(waited, first, other))


def _together(verb: str, values: list[tuple[str, Expr]]) -> Block:
    """Assign states from the values of before."""
    first = [Assign(f"work.{verb}_{name}", value) for name, value in values]
    return (*first, *(Assign(f"state.{name}", Ref(f"work.{verb}_{name}")) for name, _ in values))


def _entries() -> dict[str, Block]:
    def each(verb: str) -> Choose:
        modes = [(k, mode) for k, mode in enumerate(MODES) if verb != "update" or k != 1]
        return Choose("memory.mode", tuple((k, (Run(f"{verb}_{mode}"),)) for k, mode in modes))

    fired = Compare("!=", Ref("memory.fired"), whole(0))
    stale = Compare("!=", Ref("calibration.p"), Ref("solved.stamp_p"))
    return {
        "init": (
            Assign("memory.started", Value(False)),
            Assign("memory.mode", whole(0)),
            Assign("memory.faults", whole(0)),
            Branch(stale, (FaultBit("stale_calibration"),)),
        ),
        "step": (
            Assign("memory.fired", whole(0)),
            Branch(Ref("memory.started"), (each("advance"),), (Run("start"),)),
            each("equations"),
            each("jump"),
            Branch(fired, (each("equations"),)),
            each("update"),
            Run("remember"),
        ),
    }


def program_of(blocks: dict[str, Block], values: list[float]) -> Program:
    """Return the Program of some blocks, without the variables that they do not use."""
    a, b, p = values
    variables = [Variable(f"input.{name}", "real") for name in INPUTS]
    variables += [Variable("input.go", "truth"), Variable("is_new.u", "truth")]
    variables += [Variable(f"state.{name}", "real") for name in STATES]
    names = [*(f"r{k}" for k in range(EQUATIONS)), "m0", "m1", "total", "row"]
    variables += [Variable(f"equation.{name}", "real") for name in names]
    variables += [Variable(f"equation.q{k}", "truth") for k in range(CONDITIONS)]
    variables += [Variable("before.u", "real")]
    variables += [Variable(f"timer.{mode}", "whole") for mode in MODES]
    variables += [Variable(f"memory.{name}", "whole") for name in ("mode", "fired", "faults")]
    variables += [Variable("memory.started", "truth"), Variable("work.flag", "truth")]
    variables += [
        Variable(f"work.{verb}_{s}", "real") for verb in ("next", "reset") for s in STATES
    ]
    variables += [Variable(f"work.{name}", "real") for name in ("sum", "local")]
    variables += [Variable(f"work.{name}", "whole") for name in ("row", "turn")]
    variables += [Variable("work.list", "real", size=SIZE)]
    transitions = tuple(
        TransitionInfo(2 * k + j + 1, "t", k, (k + j + 1) % 3, Fraction(0), 0, None, "")
        for k in range(len(MODES))
        for j in range(2)
    )
    return finished(
        Program(
            name="random",
            number="float64",
            period=PERIOD,
            major_step=PERIOD,
            constants=(
                Constant("constant.a", "fixed", a),
                Constant("constant.b", "fixed", b),
                Constant("calibration.p", "tunable", p),
                Constant("derived.c", "derived", 0.0),
                Constant("derived.d", "derived", 0.0),
                Constant("solved.stamp_p", "solved", p, depends_on=("calibration.p",)),
            ),
            variables=tuple(variables),
            outputs=(
                Wire("mode", "memory.mode", "whole", "1"),
                Wire("r0", "equation.r0", "real", "1"),
                Wire("q0", "equation.q0", "truth", "1"),
            ),
            modes=tuple(ModeInfo(mode, k) for k, mode in enumerate(MODES)),
            transitions=transitions,
            faults=("stale_calibration", *(f"odd_{mode}" for mode in MODES)),
            functions=(),
            blocks=blocks,
        ),
        entries=("init", "derive", "step"),
    )


Tick = dict[str, float | bool]


@st.composite
def ticks(draw: Draw, count: int = 6) -> list[Tick]:
    """Return the inputs of some ticks, special values among them."""
    found: list[Tick] = []
    for _ in range(count):
        tick: Tick = {f"input.{name}": draw(ANY) for name in INPUTS}
        tick["input.go"], tick["is_new.u"] = draw(st.booleans()), draw(st.booleans())
        found.append(tick)
    return found


def taped(program: Program, inputs: list[Tick]) -> Tape:
    """Return what the interpreter does with some inputs."""
    stepper, tape = Interpreter(program), Tape(program, program.name)
    for tick in inputs:
        for name, value in tick.items():
            stepper.set(name, value)
        stepper.run("step")
        tape.record(stepper)
    return tape


__all__ = ["Any", "programs", "taped", "ticks"]
