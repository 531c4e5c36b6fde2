"""Exponential: the part linear in the states exactly, the rest by its value at the middle.

Exponential midpoint rule: Hochbruck and Ostermann 2010 (Acta Numerica 19, 209-286), eq. (2.40b).
Inside a step the solution of x' = A x + pull is a Taylor sum of a fixed number of terms.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from language.affine import jacobian
from language.evaluate import Scalar
from language.field import Field, at_state
from language.matrix import Matrix, exponential as matrix_exponential, exponential_integral
from language.motion import Method
from language.number import DIGITS, NumberType
from language.operation import (
    Assign,
    Block,
    Branch,
    Compare,
    Expr,
    Item,
    Loop,
    Op,
    Ref,
    Run,
    Store,
    add,
    divide,
    multiply,
    real,
    subtract,
    total,
    whole,
)
from language.problem import Problems, Span
from language.program import Constant, Variable

LARGEST_NORM = 4.0
"""|A h| up to which the Taylor sum is accurate and short (docs/language.md, section 9)."""


@dataclass(frozen=True)
class _Numbers:
    """The solved numbers of one mode, (n, n) each; `half` is over h/2."""

    a: Matrix
    whole: Matrix
    whole_pull: Matrix
    half: Matrix
    half_pull: Matrix


def exponential(
    field: Field,
    blocks: Mapping[str, Block],
    constants: Mapping[str, Scalar],
    h: Fraction,
    depends_on: tuple[str, ...],
    span: Span,
    problems: Problems,
    number: NumberType = "float64",
) -> Method:
    """Return the method for a field; `h` [s] is the whole substep."""
    made: dict[str, Block] = {}
    solved: list[Constant] = []
    terms = 1
    for name in field.automaton.modes:
        a = jacobian(blocks[f"rates_{name}"], field.states, constants)
        norm = scaled_norm(field, a) * float(h)
        if not norm <= LARGEST_NORM:
            label = f"mode `{name}` is too fast for one step: |A h| = {norm:.3g} is above 4"
            needed = math.ceil(norm / LARGEST_NORM) if math.isfinite(norm) else "more"
            problems.error("step", span, label, f"{needed} times as many `substeps` are enough")
            continue
        terms = max(terms, taylor_terms(norm, number))
        numbers = _numbers(a, float(h))
        solved += _constants(field, name, numbers, depends_on)
        made[f"step_{name}"] = _step(field, name, numbers, h)
    for name in field.automaton.modes:
        a = jacobian(blocks[f"rates_{name}"], field.states, constants)
        made[f"series_{name}"] = _series(field, name, a, terms)
    variables = [
        Variable(f"work.pull_{name}", "real", f"({state.unit.dimension})/s")
        for name, state in field.automaton.states.items()
    ]
    order = Variable("work.order", "real", about="order of a term")
    return Method(made, terms, tuple(solved), (*variables, order))


def scaled_norm(field: Field, a: Matrix) -> float:
    """Return the row-sum norm of A [1/s], each state in units of its range's width."""
    widths = []
    for state in field.automaton.states.values():
        assert state.range is not None
        widths.append(float(state.range[1] - state.range[0]))
    largest = 0.0
    for row, width in zip(a, widths, strict=True):
        size = 0.0
        for entry, other in zip(row, widths, strict=True):
            size += abs(entry) * other / width
        largest = max(largest, size)
    return largest


def taylor_terms(norm: float, number: NumberType = "float64") -> int:
    """Return the smallest K with norm^(K+1)/(K+1)! <= 2^-53, 2^-24 in float32."""
    terms, size = 0, norm
    while size > 2.0 ** -DIGITS[number]:
        terms += 1
        size = size * norm / (terms + 1)
    return max(1, terms)


def _numbers(a: Matrix, h: float) -> _Numbers:
    return _Numbers(
        a,
        matrix_exponential(a, h),
        exponential_integral(a, h),
        matrix_exponential(a, 0.5 * h),
        exponential_integral(a, 0.5 * h),
    )


def _table(numbers: _Numbers) -> dict[str, Matrix]:
    return {
        "A": numbers.a,
        "E": numbers.whole,
        "F": numbers.whole_pull,
        "Eh": numbers.half,
        "Fh": numbers.half_pull,
    }


def _name(mode: str, letter: str, row: str, column: str) -> str:
    return f"solved.{mode}_{letter}.{row}.{column}"


def _constants(
    field: Field, mode: str, numbers: _Numbers, depends_on: tuple[str, ...]
) -> list[Constant]:
    found = []
    for letter, matrix in _table(numbers).items():
        for i, row in enumerate(field.states):
            for j, column in enumerate(field.states):
                if matrix[i][j] != 0.0:
                    name = _name(mode, letter, row, column)
                    found.append(Constant(name, "solved", matrix[i][j], depends_on=depends_on))
    return found


def _row(
    field: Field, mode: str, letter: str, matrix: Matrix, i: int, values: Mapping[str, Expr]
) -> list[Expr]:
    """Return the products of one row of a matrix with values by state, zeros left out."""
    row = field.states[i]
    return [
        multiply(Ref(_name(mode, letter, row, column)), values[column])
        for j, column in enumerate(field.states)
        if matrix[i][j] != 0.0
    ]


def _pull(field: Field, mode: str, a: Matrix) -> list[Op]:
    """pull = rate - A x at the point: what is not linear."""
    at = {name: Ref(f"work.at_{name}") for name in field.states}
    ops: list[Op] = []
    for i, name in enumerate(field.states):
        linear = _row(field, mode, "A", a, i, at)
        rate = Ref(f"work.rate_{name}")
        value: Expr = subtract(rate, total(linear)) if linear else rate
        ops.append(Assign(f"work.pull_{name}", value))
    return ops


def _step(field: Field, mode: str, numbers: _Numbers, h: Fraction) -> Block:
    state: dict[str, Expr] = {name: Ref(f"state.{name}") for name in field.states}
    pull: dict[str, Expr] = {name: Ref(f"work.pull_{name}") for name in field.states}
    table = _table(numbers)

    def moved(target: str, e: str, f: str) -> Block:
        return tuple(
            Assign(
                f"work.{target}_{name}",
                total(
                    _row(field, mode, e, table[e], i, state)
                    + _row(field, mode, f, table[f], i, pull)
                ),
            )
            for i, name in enumerate(field.states)
        )

    whole_step = Compare("==", Ref("work.h"), real(h))
    series = Run(f"series_{mode}")
    middle = Assign("work.s", multiply(real(0.5), Ref("work.h")))
    end = Assign("work.s", Ref("work.h"))
    arrive = [Assign(f"work.end_{name}", Ref(f"work.at_{name}")) for name in field.states]
    return (
        *at_state(field),
        Run(f"rates_{mode}"),
        *_pull(field, mode, numbers.a),
        Branch(whole_step, moved("at", "Eh", "Fh"), (series, middle, Run("point"))),
        Run(f"rates_{mode}"),
        *_pull(field, mode, numbers.a),
        Branch(whole_step, moved("end", "E", "F"), (series, end, Run("point"), *arrive)),
    )


def _series(field: Field, mode: str, a: Matrix, terms: int) -> Block:
    """d0 = A x0 + pull, d_i = A d_(i-1) / (i + 1)."""
    state: dict[str, Expr] = {name: Ref(f"state.{name}") for name in field.states}
    order, index = Ref("work.order"), Ref("work.term")
    ops: list[Op] = [Assign("work.order", real(1.0))]
    for i, name in enumerate(field.states):
        value = total([*_row(field, mode, "A", a, i, state), Ref(f"work.pull_{name}")])
        ops.append(Store(f"work.series_{name}", whole(0), value))
    before: dict[str, Expr] = {name: Item(f"work.series_{name}", index) for name in field.states}
    body: list[Op] = [Assign("work.order", add(order, real(1.0)))]
    for i, name in enumerate(field.states):
        value = divide(total(_row(field, mode, "A", a, i, before)), order)
        body.append(Store(f"work.series_{name}", add(index, whole(1)), value))
    return (*ops, Loop(max(0, terms - 1), "work.term", tuple(body)))
