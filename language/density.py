"""Density: a spectral density of process noise that is read each tick, not constant."""

from __future__ import annotations

from collections.abc import Mapping

from language.declaration import Formula
from language.evaluate import Scalar, evaluate
from language.lower import lower_expression
from language.model import Automaton
from language.operation import Expr, real
from language.parameter import constant_bindings
from language.syntax import FunctionCall, memory_key, names as names_of, walk


def is_time_varying(automaton: Automaton, formula: Formula) -> bool:
    """Tell whether a density reads inputs, states or what they were."""
    memory = any(isinstance(part, FunctionCall) and part.function == "previous"
                 for part in walk(formula.tree))  # fmt: skip
    reads = {read.path for read in names_of(formula.tree)}
    return memory or not reads <= set(automaton.parameters)


def density_at_rest(formula: Formula, automaton: Automaton, values: Mapping[str, Scalar]) -> float:
    """Return a density while all inputs and states are 0."""
    known: dict[str, Expr] = {n: real(0.0) for n in (*automaton.inputs, *automaton.states)}
    known.update(constant_bindings(automaton))
    for part in walk(formula.tree):
        if isinstance(part, FunctionCall) and part.function == "previous":
            known[memory_key(part)] = real(0.0)
    return float(evaluate(lower_expression(formula.tree, known), values))
