"""Exponential midpoint rule and exact propagation of affine flows (rule 17e).

x' = A x + r. The linear part is propagated by e^(A h); the remainder r is held at its value in the
middle of the step (Hochbruck and Ostermann 2010, Acta Numerica 19, 209-286, eq. 2.40b). Inside a
step the solution is a Taylor sum with a fixed number of terms.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction

from language.expressions.units import rate_dimension
from language.integration.crossing_location import IntegrationMethod
from language.integration.rate_terms import non_affine_terms
from language.integration.taylor_bound import (
    max_or_nan,
    row_sum_norm,
    scale_by_ranges,
    taylor_term_count,
)
from language.integration.vector_field import VectorField, set_point_time, set_point_to_state
from language.ir.number_type import NumberType
from language.ir.ops import (
    Assign,
    Block,
    Branch,
    Compare,
    Expr,
    Item,
    Loop,
    Op,
    Ref,
    RunBlock,
    Store,
    add,
    divide,
    integer,
    multiply,
    real,
    subtract,
    sum_of,
)
from language.ir.program import Constant, Variable
from language.lowering.linearisation import LinearisationPoint
from language.numerics.affine_form import affine_forms, jacobian
from language.numerics.evaluate import Scalar
from language.numerics.matrix import Matrix, expm as matrix_exponential, expm_integral
from language.text.diagnostic import Problems, Span

MAX_STEP_NORM = 4.0
"""The largest |A h| for which the Taylor sum is accurate and short (rule 17e)."""


@dataclass(frozen=True)
class ExponentialContext:
    """The input of an exponential method: constants, step [s] and rates of each mode.

    `corners` are the constants at the ends of the ranges of the tunable parameters in `depends_on`.
    """

    point: LinearisationPoint
    corners: tuple[Mapping[str, Scalar], ...]
    step: Fraction
    rates: Mapping[str, Block]
    depends_on: tuple[str, ...]
    number_type: NumberType

    def state_matrix(self, field: VectorField, mode: str) -> Matrix:
        """Return A (n, n) of a mode [unit_i/(unit_j s)], the Jacobian of its rates.

        It has the nominal constants. Terms that are not linear with constant coefficients are left
        out.
        """
        return jacobian(self.rates[mode], field.states, self.point.constant_values)

    def scaled_step_matrices(self, field: VectorField, mode: str) -> list[Matrix]:
        """Return A h of a mode in units of the ranges (`scale_by_ranges`).

        The first matrix has the nominal constants, the others those of the corners in their order.
        An extreme value between two corners is not considered.
        """
        rates, states, h = self.rates[mode], field.states, float(self.step)
        known = (self.point.constant_values, *self.corners)
        return [
            scale_by_ranges(field, jacobian(rates, states, constants), h) for constants in known
        ]

    def states_with_remainder(self, field: VectorField, mode: str) -> frozenset[str]:
        """Return the states whose rate has a part that is not linear in the states.

        Such a part is a constant, an input or a nonlinear term. Only fixed parameters have their
        values; a term with a tunable or derived parameter counts as such a part.
        """
        known = self.point.constant_values.items()
        fixed = {name: value for name, value in known if name.startswith("constant.")}
        parts = affine_forms(self.rates[mode], field.states, fixed)
        return frozenset(n for n in field.states if parts[f"work.rate_{n}"].constant != 0.0)


def exponential_method(
    field: VectorField, context: ExponentialContext, span: Span, problems: Problems
) -> IntegrationMethod:
    """Return the exponential midpoint method for a field.

    A mode with |A h| above `MAX_STEP_NORM` is reported as an error at `span` and has no step
    blocks.
    """
    return build_exponential_method(field, context, _step_blocks, span, problems)


def build_exponential_method(
    field: VectorField,
    context: ExponentialContext,
    step_blocks: Callable[[VectorField, str, ExponentialContext], Mapping[str, Block]],
    span: Span,
    problems: Problems,
) -> IntegrationMethod:
    """Return an exponential method; `step_blocks` returns the step blocks of one mode.

    The matrices of each mode are solved constants, without their zero entries. The number of Taylor
    terms is the largest that any mode needs. A mode with |A h| above `MAX_STEP_NORM`, or NaN, at
    any corner is reported as an error at `span` and has a block `series_<mode>` only.
    """
    blocks: dict[str, Block] = {}
    constants: list[Constant] = []
    norms: dict[str, float] = {}
    steps: dict[str, list[Matrix]] = {}
    for name in field.automaton.modes:
        steps[name] = context.scaled_step_matrices(field, name)
        norms[name] = max_or_nan(row_sum_norm(step) for step in steps[name])
        if not norms[name] <= MAX_STEP_NORM:
            label = f"mode `{name}` is too fast for one step: |A h| = {norms[name]:.3g} is above 4"
            norm = norms[name]
            needed = math.ceil(norm / MAX_STEP_NORM) if math.isfinite(norm) else "more"
            problems.error("step", span, label, f"{needed} times as many `substeps` are enough")
            continue
        constants += _solved_constants(field, name, context)
        blocks.update(step_blocks(field, name, context))
        blocks[f"remainder_{name}"] = _remainder_block(field, name, context)
        blocks[f"whole_{name}"] = _propagate(field, name, ("end", "E", "F"), context)
    bounded = [
        step for name, norm in norms.items() if norm <= MAX_STEP_NORM for step in steps[name]
    ]
    terms = max((taylor_term_count(step, context.number_type) for step in bounded), default=1)
    for name in field.automaton.modes:
        blocks[f"series_{name}"] = _taylor_series(field, name, context, terms)
    variables = [
        Variable(f"work.remainder_{name}", "real", str(rate_dimension(state.unit.dimension)))
        for name, state in field.automaton.states.items()
    ]
    number = Variable("work.order", "real", about="order of a term")
    return IntegrationMethod(blocks, terms, tuple(constants), (*variables, number), norms)


def _solved_matrices(
    field: VectorField, mode: str, context: ExponentialContext
) -> dict[str, Matrix]:
    """Return A, E = e^(A h), F = integral of e^(A s) over [0, h], and Eh, Fh for half the step."""
    a, h = context.state_matrix(field, mode), float(context.step)
    return {
        "A": a,
        "E": matrix_exponential(a, h),
        "F": expm_integral(a, h),
        "Eh": matrix_exponential(a, 0.5 * h),
        "Fh": expm_integral(a, 0.5 * h),
    }


def _entry_name(mode: str, letter: str, row: str, column: str) -> str:
    """Return the name of a solved constant: `solved.<mode>_<letter>.<row>.<column>`."""
    return f"solved.{mode}_{letter}.{row}.{column}"


def _solved_constants(field: VectorField, mode: str, context: ExponentialContext) -> list[Constant]:
    """Return the nonzero entries of the solved matrices of a mode as constants."""
    found = []
    for letter, matrix in _solved_matrices(field, mode, context).items():
        for i, row in enumerate(field.states):
            for j, column in enumerate(field.states):
                if matrix[i][j] != 0.0:
                    name = _entry_name(mode, letter, row, column)
                    value, depends_on = matrix[i][j], context.depends_on
                    found.append(Constant(name, "solved", value, depends_on=depends_on))
    return found


def _row_products(
    field: VectorField, mode: str, letter: str, matrix: Matrix, i: int, values: Mapping[str, Expr]
) -> list[Expr]:
    """Return the products of row i of a matrix with values by state; zero entries are left out."""
    row = field.states[i]
    return [
        multiply(Ref(_entry_name(mode, letter, row, column)), values[column])
        for j, column in enumerate(field.states)
        if matrix[i][j] != 0.0 and column in values
    ]


def _remainder_refs(field: VectorField, mode: str, context: ExponentialContext) -> dict[str, Expr]:
    """Return the variables of the remainders of a mode, by state, if they are not always 0."""
    with_remainder = context.states_with_remainder(field, mode)
    return {name: Ref(f"work.remainder_{name}") for name in field.states if name in with_remainder}


def _remainder_block(field: VectorField, mode: str, context: ExponentialContext) -> Block:
    """Return the block that evaluates the remainder: rate - A x at the point."""
    a, with_remainder = (
        context.state_matrix(field, mode),
        context.states_with_remainder(field, mode),
    )
    at: dict[str, Expr] = {name: Ref(f"work.at_{name}") for name in field.states}
    ops: list[Op] = [RunBlock(f"rates_{mode}")]
    for i, name in enumerate(field.states):
        if name not in with_remainder:
            continue
        linear = _row_products(field, mode, "A", a, i, at)
        rate = Ref(f"work.rate_{name}")
        value: Expr = subtract(rate, sum_of(linear)) if linear else rate
        ops.append(Assign(f"work.remainder_{name}", value))
    return tuple(ops)


def lower_step_start(field: VectorField, mode: str) -> Block:
    """Return the operations that evaluate the remainder of a mode at the start of the step."""
    return (
        *set_point_to_state(field),
        *set_point_time(field, real(0.0)),
        RunBlock(f"remainder_{mode}"),
    )


def lower_step_end(field: VectorField, mode: str, context: ExponentialContext) -> Block:
    """Return the operations that set `work.end_<state>` from the states and the remainder.

    A full step, `work.h` equal to the step of the context, uses the solved matrices
    (`whole_<mode>`), a part of a step the Taylor sum.
    """
    end = Assign("work.s", Ref("work.h"))
    arrive = [Assign(f"work.end_{name}", Ref(f"work.at_{name}")) for name in field.states]
    rest: Block = (RunBlock(f"series_{mode}"), end, RunBlock("point"), *arrive)
    return (Branch(_is_full_step(context), (RunBlock(f"whole_{mode}"),), rest),)


def _is_full_step(context: ExponentialContext) -> Expr:
    """Return the condition that `work.h` is the full step."""
    return Compare("==", Ref("work.h"), real(context.step))


def _propagate(
    field: VectorField, mode: str, letters: tuple[str, str, str], context: ExponentialContext
) -> Block:
    """Return the assignments work.<target>_x = E x + F remainder; `letters` are target, E and F."""
    target, e, f = letters
    table = _solved_matrices(field, mode, context)
    state: dict[str, Expr] = {name: Ref(f"state.{name}") for name in field.states}
    remainder = _remainder_refs(field, mode, context)
    ops = []
    for i, name in enumerate(field.states):
        parts = _row_products(field, mode, e, table[e], i, state)
        parts += _row_products(field, mode, f, table[f], i, remainder)
        ops.append(Assign(f"work.{target}_{name}", sum_of(parts)))
    return tuple(ops)


def _step_blocks(field: VectorField, mode: str, context: ExponentialContext) -> Mapping[str, Block]:
    """Return the blocks of one step: remainder at the start, half step, remainder there, end."""
    half = multiply(real(0.5), Ref("work.h"))
    middle = Assign("work.s", half)
    part: Block = (RunBlock(f"series_{mode}"), middle, RunBlock("point"))
    step = (
        *lower_step_start(field, mode),
        Branch(_is_full_step(context), (RunBlock(f"half_{mode}"),), part),
        *set_point_time(field, half),
        RunBlock(f"remainder_{mode}"),
        *lower_step_end(field, mode, context),
    )
    moved = _propagate(field, mode, ("at", "Eh", "Fh"), context)
    return {f"half_{mode}": moved, f"step_{mode}": step}


def _taylor_series(
    field: VectorField, mode: str, context: ExponentialContext, term_count: int
) -> Block:
    """Return the operations that fill the series.

    d_0 = A x0 + remainder, d_i = A d_(i-1) / (i + 1)
    """
    a, remainder = context.state_matrix(field, mode), _remainder_refs(field, mode, context)
    state: dict[str, Expr] = {name: Ref(f"state.{name}") for name in field.states}
    order, index = Ref("work.order"), Ref("work.term")
    ops: list[Op] = []
    for i, name in enumerate(field.states):
        with_remainder = [remainder[name]] if name in remainder else []
        value = sum_of([*_row_products(field, mode, "A", a, i, state), *with_remainder])
        ops.append(Store(f"work.series_{name}", integer(0), value))
    if term_count < 2:
        return tuple(ops)
    before: dict[str, Expr] = {name: Item(f"work.series_{name}", index) for name in field.states}
    body: list[Op] = [Assign("work.order", add(order, real(1.0)))]
    for i, name in enumerate(field.states):
        value = divide(sum_of(_row_products(field, mode, "A", a, i, before)), order)
        body.append(Store(f"work.series_{name}", add(index, integer(1)), value))
    loop = Loop(term_count - 1, "work.term", tuple(body))
    return (Assign("work.order", real(1.0)), *ops, loop)


def exact_method(
    field: VectorField, context: ExponentialContext, span: Span, problems: Problems
) -> IntegrationMethod:
    """Return the exact method for a field: one remainder, at the start, for the whole step.

    A mode whose flow is not affine with constant coefficients is reported with the terms that are
    not, and so is a mode with |A h| above `MAX_STEP_NORM`.
    """
    for mode in field.automaton.modes.values():
        others = non_affine_terms(field.automaton, mode, context.point)
        if others:
            label = f"the flow of mode `{mode.name}` is not linear in the states with constant "
            label += f"coefficients: {', '.join(f'`{term}`' for term in others)}"
            help = "`linearise: {at: ...}` takes the tangent, `method: exponential` the middle"
            problems.error("method", span, label, help)
    return build_exponential_method(field, context, _affine_step_blocks, span, problems)


def _affine_step_blocks(
    field: VectorField, mode: str, context: ExponentialContext
) -> Mapping[str, Block]:
    """Return the block of one step of an affine flow: the remainder is constant over the step."""
    return {f"step_{mode}": (*lower_step_start(field, mode), *lower_step_end(field, mode, context))}
