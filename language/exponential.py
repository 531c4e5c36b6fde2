"""Exponential: the part linear in the states exactly, the rest by its value at the middle.

Exponential midpoint rule: Hochbruck and Ostermann 2010 (Acta Numerica 19, 209-286), eq. (2.40b).
Inside a step the solution of x' = A x + pull is a Taylor sum of a fixed number of terms.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction

from language.affine import jacobian
from language.evaluate import Scalar
from language.field import Field, at_state, at_time
from language.linear import Point
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
class Solved:
    """What a method knows before it runs: constants, the step [s], the rates of each mode.

    `corners` are the constants at the ends of the ranges of the tunables in `depends_on`.
    """

    point: Point
    corners: tuple[Mapping[str, Scalar], ...]
    h: Fraction
    rates: Mapping[str, Block]
    depends_on: tuple[str, ...]
    number: NumberType

    def matrix(self, field: Field, mode: str) -> Matrix:
        """Return A (n, n) of a mode: see `jacobian`."""
        return jacobian(self.rates[mode], field.states, self.point.values)

    def largest_norm(self, field: Field, mode: str) -> float:
        """Return the largest |A h| of a mode within the ranges of the tunables.

        It is taken at their ends: an entry that is largest between them is not seen.
        """
        norm = 0.0
        for constants in (self.point.values, *self.corners):
            found = scaled_norm(field, jacobian(self.rates[mode], field.states, constants))
            norm = found if not found <= norm else norm
        return norm * float(self.h)


def exponential(field: Field, solved: Solved, span: Span, problems: Problems) -> Method:
    """Return the method for a field."""
    return linear_motion(field, solved, _step, span, problems)


def linear_motion(
    field: Field,
    solved: Solved,
    step: Callable[[Field, str, Solved], Block],
    span: Span,
    problems: Problems,
) -> Method:
    """Return a method that has the linear part solved; `step` makes the step of a mode."""
    made: dict[str, Block] = {}
    constants: list[Constant] = []
    norms: dict[str, float] = {}
    for name in field.automaton.modes:
        norms[name] = solved.largest_norm(field, name)
        if not norms[name] <= LARGEST_NORM:
            label = f"mode `{name}` is too fast for one step: |A h| = {norms[name]:.3g} is above 4"
            norm = norms[name]
            needed = math.ceil(norm / LARGEST_NORM) if math.isfinite(norm) else "more"
            problems.error("step", span, label, f"{needed} times as many `substeps` are enough")
            continue
        constants += _constants(field, name, solved)
        made[f"step_{name}"] = step(field, name, solved)
    bounded = [norm if norm <= LARGEST_NORM else 0.0 for norm in norms.values()]
    terms = max(taylor_terms(norm, solved.number) for norm in bounded)
    for name in field.automaton.modes:
        made[f"series_{name}"] = _series(field, name, solved.matrix(field, name), terms)
    variables = [
        Variable(f"work.pull_{name}", "real", f"({state.unit.dimension})/s")
        for name, state in field.automaton.states.items()
    ]
    number = Variable("work.order", "real", about="order of a term")
    return Method(made, terms, tuple(constants), (*variables, number), norms)


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


def _table(field: Field, mode: str, solved: Solved) -> dict[str, Matrix]:
    """Return A, and E = e^(A h) with F = its integral over the step and over half of it."""
    a, h = solved.matrix(field, mode), float(solved.h)
    return {
        "A": a,
        "E": matrix_exponential(a, h),
        "F": exponential_integral(a, h),
        "Eh": matrix_exponential(a, 0.5 * h),
        "Fh": exponential_integral(a, 0.5 * h),
    }


def _name(mode: str, letter: str, row: str, column: str) -> str:
    return f"solved.{mode}_{letter}.{row}.{column}"


def _constants(field: Field, mode: str, solved: Solved) -> list[Constant]:
    found = []
    for letter, matrix in _table(field, mode, solved).items():
        for i, row in enumerate(field.states):
            for j, column in enumerate(field.states):
                if matrix[i][j] != 0.0:
                    name = _name(mode, letter, row, column)
                    value, depends_on = matrix[i][j], solved.depends_on
                    found.append(Constant(name, "solved", value, depends_on=depends_on))
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


def opening(field: Field, mode: str, solved: Solved) -> Block:
    """Return the operations that find what is not linear, at the start of the step."""
    pull = _pull(field, mode, solved.matrix(field, mode))
    start = (*at_state(field), *at_time(field, real(0.0)))
    return (*start, Run(f"rates_{mode}"), *pull)


def closing(field: Field, mode: str, solved: Solved) -> Block:
    """Return the operations that go to the end of the step; `work.pull_<state>` is known."""
    end = Assign("work.s", Ref("work.h"))
    arrive = [Assign(f"work.end_{name}", Ref(f"work.at_{name}")) for name in field.states]
    rest: Block = (Run(f"series_{mode}"), end, Run("point"), *arrive)
    moved = _moved(field, mode, ("end", "E", "F"), solved)
    return (Branch(_is_whole(solved), moved, rest),)


def _is_whole(solved: Solved) -> Expr:
    return Compare("==", Ref("work.h"), real(solved.h))


def _moved(field: Field, mode: str, letters: tuple[str, str, str], solved: Solved) -> Block:
    """x = E x + F pull into `work.<target>_<state>`; letters are target, E and F."""
    target, e, f = letters
    table = _table(field, mode, solved)
    state: dict[str, Expr] = {name: Ref(f"state.{name}") for name in field.states}
    pull: dict[str, Expr] = {name: Ref(f"work.pull_{name}") for name in field.states}
    ops = []
    for i, name in enumerate(field.states):
        parts = _row(field, mode, e, table[e], i, state)
        parts += _row(field, mode, f, table[f], i, pull)
        ops.append(Assign(f"work.{target}_{name}", total(parts)))
    return tuple(ops)


def _step(field: Field, mode: str, solved: Solved) -> Block:
    half = multiply(real(0.5), Ref("work.h"))
    middle = Assign("work.s", half)
    moved = _moved(field, mode, ("at", "Eh", "Fh"), solved)
    return (
        *opening(field, mode, solved),
        Branch(_is_whole(solved), moved, (Run(f"series_{mode}"), middle, Run("point"))),
        *at_time(field, half),
        Run(f"rates_{mode}"),
        *_pull(field, mode, solved.matrix(field, mode)),
        *closing(field, mode, solved),
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
