"""Time resolution: the step of a prediction that follows the fastest dynamics of a model."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from contextlib import suppress
from fractions import Fraction
from itertools import islice, product

import numpy as np

from language.expressions.syntax_tree import NumberLiteral, SyntaxTree
from language.expressions.units import NO_UNIT
from language.lowering.constants import constant_values, parameter_constants
from language.lowering.linearisation import (
    LinearisationPoint,
    inline_equations,
    symbolic_jacobian,
    symbolic_rates,
)
from language.model.automaton import Automaton, Mode
from language.programs.continuous_program import stable_step_limits
from language.text.diagnostic import Problems, SpecError

STEP_RATE_PRODUCT = Fraction(1, 2)
"""Largest |eigenvalue| times step; the relative error of an RK4 step is then 0.5^5 / 120 = 3e-4."""
SHORTEST_STEP = Fraction(1, 10**6)
"""Shortest step [s], whatever the eigenvalues are."""
NEARLY_ZERO = (Fraction(1, 10**12), Fraction(1, 10**9))
"""Values [SI] of all variables at rest."""
MAX_JOINT_MODES = 100
"""Most combinations of modes of parallel regions that are examined."""
MAX_RATE_RATIO = 2.0
"""Ratio of the rates at the values of `NEARLY_ZERO` above which the tangent at rest is singular."""


def time_resolution(automaton: Automaton, longest: Fraction) -> Fraction:
    """Return the longest step [s] that follows the fastest damped component of a model.

    It is `STEP_RATE_PRODUCT` over the largest eigenvalue of affine terms and of the tangent at rest
    (a smooth friction is steepest there), in `SHORTEST_STEP` to `longest`. Sampled automata and
    exponential methods give `longest`.
    """
    if automaton.is_sampled:
        return longest
    rates = [abs(limit.eigenvalue) for limit in stable_step_limits(automaton)]
    fastest = Fraction(max([*rates, rate_at_rest(automaton)])).limit_denominator(10**6)
    step = STEP_RATE_PRODUCT / fastest if fastest else longest
    return max(min(step, longest), SHORTEST_STEP)


def rate_at_rest(automaton: Automaton) -> float:
    """Return the largest damped |eigenvalue| [1/s] where all variables are about 0.

    They are `NEARLY_ZERO`, beside the corner of an absolute value. 0 if no component is damped, or
    if the tangent is singular, as that of a square root.
    """
    rates = [_rate_at(automaton, value) for value in NEARLY_ZERO]
    return max(rates) if max(rates) <= MAX_RATE_RATIO * min(rates) else 0.0


def _joint_modes(automaton: Automaton) -> Iterator[Mode]:
    """Yield each mode with the equations and balances of one mode of each parallel region."""
    for mode in automaton.modes.values():
        for others in product(*(region.modes.values() for region in automaton.regions)):
            equations = {name: one for part in others for name, one in part.equations.items()}
            flow = {name: one for part in others for name, one in part.flow.items()}
            yield dataclasses.replace(
                mode, equations={**mode.equations, **equations}, flow={**mode.flow, **flow}
            )


def _rate_at(automaton: Automaton, value: Fraction) -> float:
    """Return the largest magnitude [1/s] of a damped eigenvalue where all variables are `value`."""
    values = constant_values(parameter_constants(automaton, Problems()))
    rest: dict[str, SyntaxTree] = {
        name: NumberLiteral(value, NO_UNIT, declared.span)
        for section in (automaton.states, automaton.inputs, automaton.discrete)
        for name, declared in section.items()
    }
    point = LinearisationPoint(automaton, values, rest)
    fastest = 0.0
    for mode in islice(_joint_modes(automaton), MAX_JOINT_MODES):
        with suppress(SpecError, KeyError, ArithmeticError):
            rates = symbolic_rates(mode, inline_equations(mode, {}))
            slopes = symbolic_jacobian(rates, tuple(rates), point)
            names = list(rates)
            matrix = np.zeros((len(names), len(names)))
            for row, entries in slopes.items():
                for column, slope in entries.items():
                    matrix[names.index(row), names.index(column)] = point.evaluator(slope)
            if np.all(np.isfinite(matrix)) and matrix.size:
                eigenvalues = np.linalg.eigvals(matrix)
                damped = np.abs(eigenvalues[eigenvalues.real < 0.0])
                fastest = max(fastest, float(np.max(damped, initial=0.0)))
    return fastest
