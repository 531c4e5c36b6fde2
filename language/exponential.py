"""Exponential: the part linear in the states exactly, the rest by its value at the middle.

Exponential midpoint rule: Hochbruck and Ostermann 2010 (Acta Numerica 19, 209-286), eq. (2.40b).
Inside a step the solution of x' = A x + pull is a Taylor sum of a fixed number of terms (rule 17e).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction

from language.affine import affine_parts, jacobian
from language.evaluate import Scalar
from language.field import Field, at_state, at_time
from language.linear import Point
from language.matrix import (
    Matrix,
    exponential as matrix_exponential,
    exponential_integral,
)
from language.motion import Method
from language.number import NumberType
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
from language.taylor import in_ranges, largest, row_sum_norm, taylor_terms
from language.units import per_second

LARGEST_NORM = 4.0
"""|A h| up to which the Taylor sum is accurate and short (rule 17e)."""


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

    def steps(self, field: Field, mode: str) -> list[Matrix]:
        """Return A h of a mode in units of the ranges, also at the ends of those of the tunables.

        An entry that is largest between them is not seen.
        """
        rates, states, h = self.rates[mode], field.states, float(self.h)
        known = (self.point.values, *self.corners)
        return [in_ranges(field, jacobian(rates, states, constants), h) for constants in known]

    def pulled(self, field: Field, mode: str) -> frozenset[str]:
        """Return the states whose rate is more than its row of A, whatever the calibration."""
        known = self.point.values.items()
        fixed = {name: value for name, value in known if name.startswith("constant.")}
        parts = affine_parts(self.rates[mode], field.states, fixed)
        return frozenset(n for n in field.states if parts[f"work.rate_{n}"].constant != 0.0)


def exponential(field: Field, solved: Solved, span: Span, problems: Problems) -> Method:
    """Return the method for a field."""
    return linear_motion(field, solved, _step, span, problems)


def linear_motion(
    field: Field,
    solved: Solved,
    step: Callable[[Field, str, Solved], Mapping[str, Block]],
    span: Span,
    problems: Problems,
) -> Method:
    """Return a method that has the linear part solved; `step` makes the blocks of a mode's."""
    made: dict[str, Block] = {}
    constants: list[Constant] = []
    norms: dict[str, float] = {}
    steps: dict[str, list[Matrix]] = {}
    for name in field.automaton.modes:
        steps[name] = solved.steps(field, name)
        norms[name] = largest(row_sum_norm(step) for step in steps[name])
        if not norms[name] <= LARGEST_NORM:
            label = f"mode `{name}` is too fast for one step: |A h| = {norms[name]:.3g} is above 4"
            norm = norms[name]
            needed = math.ceil(norm / LARGEST_NORM) if math.isfinite(norm) else "more"
            problems.error("step", span, label, f"{needed} times as many `substeps` are enough")
            continue
        constants += _constants(field, name, solved)
        made.update(step(field, name, solved))
        made[f"pull_{name}"] = _pull(field, name, solved)
        made[f"whole_{name}"] = _moved(field, name, ("end", "E", "F"), solved)
    bounded = [step for name, norm in norms.items() if norm <= LARGEST_NORM for step in steps[name]]
    terms = max((taylor_terms(step, solved.number) for step in bounded), default=1)
    for name in field.automaton.modes:
        made[f"series_{name}"] = _series(field, name, solved, terms)
    variables = [
        Variable(f"work.pull_{name}", "real", str(per_second(state.unit.dimension)))
        for name, state in field.automaton.states.items()
    ]
    number = Variable("work.order", "real", about="order of a term")
    return Method(made, terms, tuple(constants), (*variables, number), norms)


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
        if matrix[i][j] != 0.0 and column in values
    ]


def _pulls(field: Field, mode: str, solved: Solved) -> dict[str, Expr]:
    pulled = solved.pulled(field, mode)
    return {name: Ref(f"work.pull_{name}") for name in field.states if name in pulled}


def _pull(field: Field, mode: str, solved: Solved) -> Block:
    """pull = rate - A x at the point: what is not linear."""
    a, pulled = solved.matrix(field, mode), solved.pulled(field, mode)
    at: dict[str, Expr] = {name: Ref(f"work.at_{name}") for name in field.states}
    ops: list[Op] = [Run(f"rates_{mode}")]
    for i, name in enumerate(field.states):
        if name not in pulled:
            continue
        linear = _row(field, mode, "A", a, i, at)
        rate = Ref(f"work.rate_{name}")
        value: Expr = subtract(rate, total(linear)) if linear else rate
        ops.append(Assign(f"work.pull_{name}", value))
    return tuple(ops)


def opening(field: Field, mode: str) -> Block:
    """Return the operations that find what is not linear, at the start of the step."""
    return (*at_state(field), *at_time(field, real(0.0)), Run(f"pull_{mode}"))


def closing(field: Field, mode: str, solved: Solved) -> Block:
    """Return the operations that go to the end of the step; `work.pull_<state>` is known."""
    end = Assign("work.s", Ref("work.h"))
    arrive = [Assign(f"work.end_{name}", Ref(f"work.at_{name}")) for name in field.states]
    rest: Block = (Run(f"series_{mode}"), end, Run("point"), *arrive)
    return (Branch(_is_whole(solved), (Run(f"whole_{mode}"),), rest),)


def _is_whole(solved: Solved) -> Expr:
    return Compare("==", Ref("work.h"), real(solved.h))


def _moved(field: Field, mode: str, letters: tuple[str, str, str], solved: Solved) -> Block:
    """x = E x + F pull into `work.<target>_<state>`; letters are target, E and F."""
    target, e, f = letters
    table = _table(field, mode, solved)
    state: dict[str, Expr] = {name: Ref(f"state.{name}") for name in field.states}
    pull = _pulls(field, mode, solved)
    ops = []
    for i, name in enumerate(field.states):
        parts = _row(field, mode, e, table[e], i, state)
        parts += _row(field, mode, f, table[f], i, pull)
        ops.append(Assign(f"work.{target}_{name}", total(parts)))
    return tuple(ops)


def _step(field: Field, mode: str, solved: Solved) -> Mapping[str, Block]:
    half = multiply(real(0.5), Ref("work.h"))
    middle = Assign("work.s", half)
    part: Block = (Run(f"series_{mode}"), middle, Run("point"))
    step = (
        *opening(field, mode),
        Branch(_is_whole(solved), (Run(f"half_{mode}"),), part),
        *at_time(field, half),
        Run(f"pull_{mode}"),
        *closing(field, mode, solved),
    )
    moved = _moved(field, mode, ("at", "Eh", "Fh"), solved)
    return {f"half_{mode}": moved, f"step_{mode}": step}


def _series(field: Field, mode: str, solved: Solved, terms: int) -> Block:
    """d0 = A x0 + pull, d_i = A d_(i-1) / (i + 1)."""
    a, pull = solved.matrix(field, mode), _pulls(field, mode, solved)
    state: dict[str, Expr] = {name: Ref(f"state.{name}") for name in field.states}
    order, index = Ref("work.order"), Ref("work.term")
    ops: list[Op] = [Assign("work.order", real(1.0))]
    for i, name in enumerate(field.states):
        pulled = [pull[name]] if name in pull else []
        value = total([*_row(field, mode, "A", a, i, state), *pulled])
        ops.append(Store(f"work.series_{name}", whole(0), value))
    before: dict[str, Expr] = {name: Item(f"work.series_{name}", index) for name in field.states}
    body: list[Op] = [Assign("work.order", add(order, real(1.0)))]
    for i, name in enumerate(field.states):
        value = divide(total(_row(field, mode, "A", a, i, before)), order)
        body.append(Store(f"work.series_{name}", add(index, whole(1)), value))
    return (*ops, Loop(max(0, terms - 1), "work.term", tuple(body)))
