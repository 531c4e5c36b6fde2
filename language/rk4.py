"""RK4: the classical Runge-Kutta method (Kutta 1901) with a cubic Hermite polynomial inside.

Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.1 table 1.2 and II.6 (6.7).
"""

from __future__ import annotations

from language.field import Field, at_state, at_time
from language.motion import Method
from language.operation import (
    Assign,
    Block,
    Expr,
    Op,
    Ref,
    Run,
    Store,
    add,
    divide,
    multiply,
    real,
    subtract,
    whole,
)
from language.program import Variable
from language.units import per_second

TERMS = 3
STAGES = (1, 2, 3, 4)
CUBIC = "cubic"


def rk4(field: Field) -> Method:
    """Return the method for a field. Where that `is_staged`, what all modes do alike is a block of
    its own: an ECU that computes in software has the values of one stage on its stack, not of all.
    """
    blocks: dict[str, Block] = {}
    stages = {f"stage_{stage}": tuple(_stage(field, stage)) for stage in STAGES}
    alike = {**stages, CUBIC: tuple(_cubic(field))} if field.is_staged else {}
    blocks.update(alike)
    for name in field.automaton.modes:
        blocks[f"step_{name}"] = _step(field, name)
        blocks[f"series_{name}"] = _series(field, name)
    variables = [
        Variable(f"work.k{stage}_{name}", "real", str(per_second(state.unit.dimension)))
        for stage in STAGES
        for name, state in field.automaton.states.items()
    ]
    slopes = [
        Variable(f"work.slope_{name}", "real", str(per_second(state.unit.dimension)))
        for name, state in field.automaton.states.items()
    ]
    return Method(blocks, TERMS, (), (*variables, *slopes))


def _step(field: Field, mode: str) -> Block:
    ops: list[Op] = [*at_state(field), *at_time(field, real(0.0))]
    for stage in STAGES:
        ops.append(Run(f"rates_{mode}"))
        ops += [Run(f"stage_{stage}")] if field.is_staged else _stage(field, stage)
    return tuple(ops)


def _stage(field: Field, stage: int) -> list[Op]:
    """Keep the rates; go to where the next ones are taken, or to the end."""
    h = Ref("work.h")
    ops: list[Op] = [
        Assign(f"work.k{stage}_{name}", Ref(f"work.rate_{name}")) for name in field.states
    ]
    if stage == STAGES[-1]:
        return ops + [Assign(f"work.end_{name}", _end(name)) for name in field.states]
    part = h if stage == STAGES[-2] else multiply(real(0.5), h)
    ops += at_time(field, part)
    for name in field.states:
        moved = add(Ref(f"state.{name}"), multiply(part, Ref(f"work.k{stage}_{name}")))
        ops.append(Assign(f"work.at_{name}", moved))
    return ops


def _end(name: str) -> Expr:
    """x + h/6 (k1 + 2 k2 + 2 k3 + k4)."""
    k1, k2, k3, k4 = (Ref(f"work.k{stage}_{name}") for stage in STAGES)
    inner = add(add(add(k1, multiply(real(2.0), k2)), multiply(real(2.0), k3)), k4)
    return add(Ref(f"state.{name}"), multiply(divide(Ref("work.h"), real(6.0)), inner))


def _series(field: Field, mode: str) -> Block:
    ops: list[Op] = [Assign(f"work.at_{name}", Ref(f"work.end_{name}")) for name in field.states]
    ops += at_time(field, Ref("work.h"))
    ops.append(Run(f"rates_{mode}"))
    ops += [Run(CUBIC)] if field.is_staged else _cubic(field)
    return tuple(ops)


def _cubic(field: Field) -> list[Op]:
    """The cubic through both ends with the rates f0 = k1 at the start and f1 at the end."""
    h = Ref("work.h")
    ops: list[Op] = []
    for name in field.states:
        f0, f1 = Ref(f"work.k1_{name}"), Ref(f"work.rate_{name}")
        slope, series = Ref(f"work.slope_{name}"), f"work.series_{name}"
        rise = subtract(Ref(f"work.end_{name}"), Ref(f"state.{name}"))
        ops.append(Assign(slope.name, divide(rise, h)))
        second = subtract(subtract(multiply(real(3.0), slope), multiply(real(2.0), f0)), f1)
        third = subtract(add(f0, f1), multiply(real(2.0), slope))
        ops.append(Store(series, whole(0), f0))
        ops.append(Store(series, whole(1), divide(second, h)))
        ops.append(Store(series, whole(2), divide(third, multiply(h, h))))
    return ops
