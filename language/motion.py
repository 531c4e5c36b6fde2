"""Motion: flow of a field over `work.h` up to the first crossing, located inside the step.

A method gives three things: a block `step_<mode>` from the states to `work.end_<state>`, a block
`series_<mode>` that fills `work.series_<state>` with a polynomial through the step, and the number
of its terms. What is here is common: look at the guards at the end, and where one changed, halve
the bracket on the polynomial; the upper end is kept, so the guard is true where it is committed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from language.field import Field, any_guard, at_time
from language.look import Polynomials, look_block
from language.model import Mode
from language.number import DIGITS, NumberType
from language.operation import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Expr,
    Loop,
    Op,
    Ref,
    Run,
    Store,
    Unary,
    Value,
    add,
    multiply,
    real,
    subtract,
    whole,
)
from language.program import Constant, Variable
from language.region import slots
from language.resting import movable, resting
from language.units import per_second

MERGE_ULPS = 4096
"""Events nearer than this are one instant (rule 10): rounding moves a crossing by some ten ULPs."""
RUN_HALVINGS = 24
"""Halvings inside a tick: 1 ms / 2^24 = 60 ps (rule 9); in float32 an ULP."""
FLOW_HALVINGS: Mapping[NumberType, int] = {"float64": 44, "float32": 24}
"""Halvings of a continuous automaton's step: 1 ms / 2^44 is below one ULP of a time of 1 s. In
float32 the times within a step have 24 bits: from then on the middle is one of the two ends."""

Armed = Mapping[str, str]


@dataclass(frozen=True)
class Method:
    """A method of integration for one field; `norms` are |A h| of each mode, where it has them.

    `resting` are the states that move in no mode: they have no polynomial.
    """

    blocks: dict[str, Block]
    terms: int
    constants: tuple[Constant, ...]
    variables: tuple[Variable, ...]
    norms: Mapping[str, float] = field(default_factory=dict)
    resting: frozenset[str] = frozenset()


def at_rest(field: Field, mode: str) -> list[Op]:
    """Return the ends of a step of the states that rest in a mode."""
    still = resting(field.automaton.modes[mode])
    return [Assign(f"work.end_{n}", Ref(f"state.{n}")) for n in field.states if n in still]


def flat(field: Field, mode: str, terms: int) -> list[Op]:
    """Return the polynomials of a mode's step of the states that rest in this mode, not in all."""
    still = resting(field.automaton.modes[mode])
    names = [name for name in movable(field.automaton) if name in still]
    return [Store(f"work.series_{n}", whole(k), real(0.0)) for n in names for k in range(terms)]


def merge_time(number: NumberType, step: Fraction, time: Fraction = Fraction(0)) -> float:
    """Return the time [s] within which events are one instant, at a time since the start.

    In float64 ULPs of the time: 0.9 ps at 1 s. A float32 knows the time within the step only, and
    its states are as coarse: ULPs of the step, 0.5 us in 1 ms.
    """
    whole = max(time, step) if number == "float64" else step
    return float(whole) * MERGE_ULPS * 2.0 ** (1 - DIGITS[number])


def motion_blocks(
    field: Field,
    method: Method,
    flows: Mapping[str, Block],
    merge: Expr,
    halvings: int,
    armed: Callable[[Mode], Armed | None],
    is_wait: Expr | None = None,
) -> dict[str, Block]:
    """Return `point`, and `look_<mode>`, `locate_<mode>` and `move_<mode>` of every mode.

    `flows` are the blocks of the field. What crosses within `merge` [s] is one instant; `armed`
    gives a mode's guards as they were; `is_wait` is whether a wait ends with the step: what
    crosses just after it is at that instant.
    """
    paths = Polynomials(method.terms, method.resting)
    blocks = {"point": paths.at(field.states)}
    for mode in field.automaton.modes.values():
        blocks[f"look_{mode.name}"] = look_block(field, mode, paths, flows)
        crossed = any_guard(field, mode, armed(mode))
        blocks[f"locate_{mode.name}"] = _locate(field, mode, crossed, halvings, merge)
        blocks[f"move_{mode.name}"] = _move(field, mode, crossed, merge, is_wait)
    return blocks


def motion_variables(field: Field, method: Method) -> list[Variable]:
    """Return the work variables of a motion."""
    found = [
        Variable("work.h", "real", "s", about="step to flow over"),
        Variable("work.elapsed", "real", "s", about="part of the step until a crossing"),
        Variable("work.crossed", "truth", about="a guard has turned true in the step"),
        Variable("work.s", "real", "s", about="time since the start of the step"),
        Variable("work.low", "real", "s"),
        Variable("work.high", "real", "s"),
        Variable("work.halving", "whole"),
        Variable(
            "work.is_before_end", "truth", about="a guard turns true before the end of the step"
        ),
        Variable("work.term", "whole"),
        *(Variable(f"work.guard_{k}_at_high", "truth") for k in field.slots),
    ]
    for name, state in field.automaton.states.items():
        dimension = state.unit.dimension
        unit, rate = str(dimension), str(per_second(dimension))
        found.append(Variable(f"work.end_{name}", "real", unit, about="at the end of the step"))
        if name in method.resting:
            continue
        found.append(Variable(f"work.sum_{name}", "real", rate))
        about = "factor of s; those of s^2, s^3, ... have one more 1/s each"
        found.append(Variable(f"work.series_{name}", "real", rate, about=about, size=method.terms))
    return [*found, *method.variables]


def _locate(field: Field, mode: Mode, crossed: Expr, halvings: int, merge: Expr) -> Block:
    """Halve (low, high]: a guard has changed at high, none has at low."""
    low, high, inside = Ref("work.low"), Ref("work.high"), "work.is_before_end"
    middle = add(low, multiply(real(0.5), subtract(high, low)))
    body: Block = (
        *_look(mode, middle),
        Branch(
            crossed,
            (Assign("work.high", Ref("work.s")), Assign(inside, Value(True))),
            (Assign("work.low", Ref("work.s")),),
        ),
    )
    return (
        Assign("work.low", real(0.0)),
        Assign("work.high", Ref("work.h")),
        Assign(inside, Value(False)),
        Loop(halvings, "work.halving", body),
        *_at_high(field, mode, Ref(inside)),
        *_merged(field, mode, merge),
        Assign("work.elapsed", Call("min", (high, Ref("work.h")))),
    )


def _at_high(field: Field, mode: Mode, inside: Expr) -> Block:
    """Take the point at the upper end where that lies inside, and read the guards there if more
    than one may change.
    """
    high = Ref("work.high")
    kept = (Assign("work.s", high), *_kept(field))
    if len(slots(mode)) < 2:
        return (Branch(inside, kept),)
    return (Branch(inside, (*kept, Run(f"guards_{mode.name}")), _look(mode, high)),)


def _look(mode: Mode, s: Expr, why: str = "") -> Block:
    """Read the guards at `s`."""
    return (Assign("work.s", s, why), Run(f"look_{mode.name}"))


def _kept(field: Field) -> Block:
    """Take the point at `work.s` for the end."""
    keep = [Assign(f"work.end_{name}", Ref(f"work.at_{name}")) for name in field.states]
    return (Run("point"), *keep)


def _merged(field: Field, mode: Mode, merge: Expr) -> Block:
    """Where another guard changes within `merge` after the first, take both as one instant; what
    they are at the first is known.
    """
    watched = slots(mode)
    if len(watched) < 2:
        return ()
    first = [Assign(f"work.guard_{k}_at_high", Ref(f"work.guard_{k}")) for k in watched]
    another: Expr = Value(False)
    for position, k in enumerate(watched):
        turned = Binary("and", Ref(f"work.guard_{k}"), Unary("not", Ref(f"work.guard_{k}_at_high")))
        another = turned if position == 0 else Binary("or", another, turned)
    high = Ref("work.high")
    accepted: Block = (Assign("work.high", Ref("work.s")), *_kept(field))
    return (
        *first,
        *_look(mode, add(high, merge), "what turns true until then does so at the same instant"),
        Branch(another, accepted),
    )


def _move(field: Field, mode: Mode, crossed: Expr, merge: Expr, is_wait: Expr | None) -> Block:
    watched = slots(mode)
    ops: list[Op] = [Run(f"step_{mode.name}"), Assign("work.elapsed", Ref("work.h"))]
    if watched:
        ops += [Assign(f"work.at_{name}", Ref(f"work.end_{name}")) for name in field.states]
        ops += at_time(field, Ref("work.h"))
        ops.append(Run(f"guards_{mode.name}"))
    ops.append(Assign("work.crossed", crossed if watched else Value(False)))
    if watched:
        found: Block = (Run(f"series_{mode.name}"), Run(f"locate_{mode.name}"))
        just_after = () if is_wait is None else _just_after(field, mode, crossed, merge, is_wait)
        ops.append(Branch(Ref("work.crossed"), found, just_after))
    ops += [Assign(f"state.{name}", Ref(f"work.end_{name}")) for name in field.states]
    return tuple(ops)


def _just_after(field: Field, mode: Mode, crossed: Expr, merge: Expr, is_wait: Expr) -> Block:
    """A guard that changes within `merge` after the end of a wait changes at that instant."""
    look = (Run(f"series_{mode.name}"), *_look(mode, add(Ref("work.h"), merge)))
    change = Branch(crossed, (Assign("work.crossed", Value(True)), *_kept(field)))
    return (Branch(is_wait, (*look, change)),)
