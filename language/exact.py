"""Exact: an affine flow over the whole step by its matrix exponential, inside it by a Taylor sum.

x(h) = e^(A h) x + h phi_1(A h) g for x' = A x + g with g held: Van Loan 1978 (IEEE Trans. Autom.
Control 23, 395-404). Only for flows that are affine in the states with constant coefficients.
"""

from __future__ import annotations

from collections.abc import Mapping

from language.exponential import Solved, closing, linear_motion, opening
from language.field import Field
from language.motion import Method
from language.operation import Block
from language.problem import Problems, Span
from language.terms import other_terms


def exact(field: Field, solved: Solved, span: Span, problems: Problems) -> Method:
    """Return the method for a field, with a problem for each mode that is not affine."""
    for mode in field.automaton.modes.values():
        others = other_terms(field.automaton, mode, solved.point)
        if others:
            label = f"the flow of mode `{mode.name}` is not linear in the states with constant "
            label += f"coefficients: {', '.join(f'`{term}`' for term in others)}"
            help = "`linearise: {at: ...}` takes the tangent, `method: exponential` the middle"
            problems.error("method", span, label, help)
    return linear_motion(field, solved, _step, span, problems)


def _step(field: Field, mode: str, solved: Solved) -> Mapping[str, Block]:
    return {f"step_{mode}": (*opening(field, mode), *closing(field, mode, solved))}
