"""Satisfiability query: asks whether conditions can hold together.

A query has a sequence of assignments that precede the conditions, and a domain for each variable. A
witness is a valuation, that is a value for every variable, at which the conditions evaluate to
true. Every witness is evaluated with the arithmetic of this project before it is reported, so it
does not depend on a solver.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, MutableMapping
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property

from language.ir.ops import Expr
from language.ir.program import ValueType
from language.ir.traversal import expr_names
from language.numerics.evaluate import Scalar, evaluate

DISPLAY_DIGITS = (2, 3, 4, 6, 9, 12)
"""Significant digits of displayed values: the first at which the conditions still hold is used."""

Valuation = MutableMapping[str, Scalar]
"""Value of each variable by its name."""
SymbolicAssignment = tuple[str, Expr]
"""Name of the assigned variable and its expression; a sequence of them is evaluated in order."""


@dataclass(frozen=True)
class VariableDomain:
    """Set of values of a variable: its type, bounds in SI units, or a finite set of integers.

    `low` and `high` are inclusive; None means unbounded. If `numbers` is not empty, only these
    values are allowed. `names` are the names of an enumeration, indexed by value. `default` is the
    value that sampling prefers.
    """

    type: ValueType = "real"
    low: Fraction | None = None
    high: Fraction | None = None
    numbers: tuple[int, ...] = ()
    names: tuple[str, ...] = ()
    default: Scalar | None = None

    def contains(self, value: Scalar) -> bool:
        """Return whether a value lies between the bounds, and in `numbers` if that is not empty."""
        low, high = self._bounds
        return low <= value <= high and (not self.numbers or value in self.numbers)

    @cached_property
    def _bounds(self) -> tuple[float, float]:
        """Return the bounds as floats, with infinities for absent ones."""
        low = -math.inf if self.low is None else float(self.low)
        return low, math.inf if self.high is None else float(self.high)


@dataclass(frozen=True)
class SolverQuery:
    """Query whether all conditions can hold after the assignments for some values of the variables.

    `domains` gives the variables. `parameter_values` gives the constants by name: a number, or a
    tuple for a table.
    """

    conditions: tuple[Expr, ...]
    assignments: tuple[SymbolicAssignment, ...]
    domains: Mapping[str, VariableDomain]
    parameter_values: Mapping[str, Scalar] = field(repr=False)

    @cached_property
    def variables(self) -> list[str]:
        """Names of the variables that the conditions depend on, in the order of `domains`."""
        read = self.names_read
        return [name for name in self.domains if name in read]

    @cached_property
    def names_read(self) -> set[str]:
        """Names that the conditions read, directly or through the assignments.

        Variables, constants and assigned names are included.
        """
        result = {name for condition in self.conditions for name in expr_names(condition)}
        for target, value in reversed(self.assignments):
            if target in result:
                result.update(expr_names(value))
        return result

    @cached_property
    def key(self) -> object:
        """Hashable content of the query: queries with equal keys have equal answers.

        It has only the assignments, domains and parameter values that the conditions depend on.
        """
        domains = tuple((name, self.domains[name]) for name in self.variables)
        return (
            self.conditions,
            tuple(self._needed_assignments),
            domains,
            tuple(self._read_parameter_values.items()),
        )

    @cached_property
    def _needed_assignments(self) -> list[SymbolicAssignment]:
        """Assignments to names that the conditions depend on, in order."""
        return [(target, value) for target, value in self.assignments if target in self.names_read]

    @cached_property
    def _read_parameter_values(self) -> dict[str, Scalar]:
        """Values of the parameters that the conditions depend on."""
        return {
            name: value for name, value in self.parameter_values.items() if name in self.names_read
        }

    def holds_at(self, point: Mapping[str, Scalar]) -> bool:
        """Return whether a point lies within the domains and makes all conditions true.

        The result is False if a name has no value or an evaluation fails (overflow, domain error).
        The point may lack variables that nothing reads.
        """
        try:
            if not all(self.domains[name].contains(value) for name, value in point.items()):
                return False
            values = {**self._read_parameter_values, **point}
            for target, value in self._needed_assignments:
                values[target] = evaluate(value, values)
            return all(evaluate(condition, values) is True for condition in self.conditions)
        except (KeyError, OverflowError, ValueError):
            return False

    def value_at(self, point: Mapping[str, Scalar], expr: Expr) -> float:
        """Return the value of an expression at a point, after all assignments.

        An assignment whose operands have no value is skipped. Neither domains nor conditions are
        checked. Raises KeyError if the expression reads a name without a value.
        """
        values = {**self.parameter_values, **point}
        for target, value in self.assignments:
            with suppress(KeyError):  # a name that the conditions do not read may have no value
                values[target] = evaluate(value, values)
        return float(evaluate(expr, values))

    def shorten(self, point: Valuation) -> Valuation:
        """Return the point with floats rounded to the fewest digits at which the conditions hold.

        The point is returned unchanged if they hold at none of the roundings in DISPLAY_DIGITS.
        Bools and integers are kept.
        """
        for digits in DISPLAY_DIGITS:
            shorter: Valuation = {
                name: float(f"{value:.{digits}g}") if isinstance(value, float) else value
                for name, value in point.items()
            }
            if self.holds_at(shorter):
                return shorter
        return point


def format_valuation(point: Mapping[str, Scalar], domains: Mapping[str, VariableDomain]) -> str:
    """Return a point as text: `x = 0.5, ready = true, key = parked`.

    The order is that of `point`; values are in SI. The prefix of a name up to its first dot is left
    out. A number is the shortest text that reads back as the same float; a value of a domain with
    names is its name. An empty point gives "".
    """
    return ", ".join(
        f"{name.partition('.')[2] or name} = {_format_value(value, domains[name])}"
        for name, value in point.items()
    )


def _format_value(value: Scalar, domain: VariableDomain) -> str:
    """Return it as text: `true` or `false`, a name of an enumeration, or the shortest number."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if domain.names:
        return domain.names[int(value)]
    return _format_shortest(float(value))


def _format_shortest(value: float) -> str:
    """Return the shortest text of at most 17 digits that reads back as the same float."""
    return next(text for n in (4, 6, 9, 12, 15, 17) if float(text := f"{value:.{n}g}") == value)
