"""Exact: an affine flow over the whole step by its matrix exponential, inside it by a Taylor sum.

x(h) = e^(A h) x + h phi_1(A h) g for x' = A x + g with g held: Van Loan 1978 (IEEE Trans. Autom.
Control 23, 395-404). Only for flows that are affine in the states with constant coefficients.
"""

from __future__ import annotations

from collections.abc import Mapping

from language.exponential import (
    ExponentialContext,
    build_exponential_method,
    lower_step_end,
    lower_step_start,
)
from language.field import VectorField
from language.motion import IntegrationMethod
from language.operation import Block
from language.problem import Problems, Span
from language.terms import non_affine_terms


def exact_method(
    field: VectorField, context: ExponentialContext, span: Span, problems: Problems
) -> IntegrationMethod:
    """Return the method for a field, with a problem for each mode that is not affine."""
    for mode in field.automaton.modes.values():
        others = non_affine_terms(field.automaton, mode, context.point)
        if others:
            label = f"the flow of mode `{mode.name}` is not linear in the states with constant "
            label += f"coefficients: {', '.join(f'`{term}`' for term in others)}"
            help = "`linearise: {at: ...}` takes the tangent, `method: exponential` the middle"
            problems.error("method", span, label, help)
    return build_exponential_method(field, context, _step_blocks, span, problems)


def _step_blocks(field: VectorField, mode: str, context: ExponentialContext) -> Mapping[str, Block]:
    return {f"step_{mode}": (*lower_step_start(field, mode), *lower_step_end(field, mode, context))}
