"""Entries: the matrices of an observer in numbers, from the formulas of their entries."""

from __future__ import annotations

from collections.abc import Mapping

from language.lowering.constants import evaluate_constant
from language.model.automaton import Automaton, Observer
from language.model.declaration import Formula
from language.numerics.evaluate import Scalar
from language.numerics.matrix import Matrix


def numeric_matrix(
    automaton: Automaton,
    values: Mapping[str, Scalar],
    entries: Mapping[str, Mapping[str, Formula]],
    rows: tuple[str, ...],
    columns: tuple[str, ...],
    what: str,
) -> Matrix:
    """Return a matrix of formulas in numbers, by row and column name."""

    def value(row: str, column: str) -> float:
        formula = entries.get(row, {}).get(column)
        return evaluate_constant(formula, automaton, values, what) if formula else 0.0

    return tuple(tuple(value(row, column) for column in columns) for row in rows)


def numeric_diagonal(
    automaton: Automaton,
    values: Mapping[str, Scalar],
    entries: Mapping[str, Formula],
    names: tuple[str, ...],
) -> Matrix:
    """Return a diagonal matrix of formulas in numbers."""
    rows = {name: {name: formula} for name, formula in entries.items()}
    return numeric_matrix(automaton, values, rows, names, names, "noise")


def output_matrix(automaton: Automaton, values: Mapping[str, Scalar], observer: Observer) -> Matrix:
    """Return C (measures, states)."""
    measures = tuple(observer.measures)
    if observer.c:
        return numeric_matrix(automaton, values, observer.c, measures, observer.states, "C")
    return tuple(
        tuple(1.0 if state == observer.measures[name] else 0.0 for state in observer.states)
        for name in measures
    )
