"""Numeric matrices of an observer, from the formulas of their entries."""

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
    """Return the matrix (rows, columns) of the values of formulas by row and column name.

    A missing entry is 0; entries of other rows and columns are ignored. `what` names the matrix in
    messages. Raises SpecError if a formula reads anything but parameters or is not finite.
    """

    def value(row: str, column: str) -> float:
        """Return the value of an entry; 0 without a formula."""
        formula = entries.get(row, {}).get(column)
        return evaluate_constant(formula, automaton, values, what) if formula else 0.0

    return tuple(tuple(value(row, column) for column in columns) for row in rows)


def numeric_diagonal(
    automaton: Automaton,
    values: Mapping[str, Scalar],
    entries: Mapping[str, Formula],
    names: tuple[str, ...],
) -> Matrix:
    """Return the diagonal matrix (names, names) of the values of formulas by name.

    A missing entry is 0; formulas of other names are ignored. Raises SpecError if a formula reads
    anything but parameters or is not finite.
    """
    rows = {name: {name: formula} for name, formula in entries.items()}
    return numeric_matrix(automaton, values, rows, names, names, "noise")


def output_matrix(automaton: Automaton, values: Mapping[str, Scalar], observer: Observer) -> Matrix:
    """Return C (measures, states) of an observer.

    Without formulas, each row has a 1 at the state that it measures. Raises SpecError if a formula
    reads anything but parameters or is not finite.
    """
    measures = tuple(observer.measures)
    if observer.c:
        return numeric_matrix(automaton, values, observer.c, measures, observer.states, "C")
    return tuple(
        tuple(1.0 if state == observer.measures[name] else 0.0 for state in observer.states)
        for name in measures
    )
