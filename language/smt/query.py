"""Question: can these conditions hold together? Steps of scalar expressions and what they read.

A witness is a point: a value for every variable. It is told only where the conditions, evaluated
there by our own arithmetic, are true; so a witness is true whatever found it.
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
"""Digits of the values shown: the first number of them at which the conditions still hold."""

Valuation = MutableMapping[str, Scalar]
SymbolicAssignment = tuple[str, Expr]


@dataclass(frozen=True)
class VariableDomain:
    """What a variable can be: its type, its bounds (SI) where it has some, or a few numbers.

    `names` are those of an enumeration, `default` is what it is where nothing speaks against it.
    """

    type: ValueType = "real"
    low: Fraction | None = None
    high: Fraction | None = None
    numbers: tuple[int, ...] = ()
    names: tuple[str, ...] = ()
    default: Scalar | None = None

    def holds(self, value: Scalar) -> bool:
        """Tell whether a value is one that the variable can have."""
        low, high = self._bounds
        return low <= value <= high and (not self.numbers or value in self.numbers)

    @cached_property
    def _bounds(self) -> tuple[float, float]:
        low = -math.inf if self.low is None else float(self.low)
        return low, math.inf if self.high is None else float(self.high)


@dataclass(frozen=True)
class SolverQuery:
    """Whether all conditions can hold: after the steps, whatever the variables are.

    `values` are those of parameters: numbers, and tuples for tables.
    """

    conditions: tuple[Expr, ...]
    assignments: tuple[SymbolicAssignment, ...]
    domains: Mapping[str, VariableDomain]
    parameter_values: Mapping[str, Scalar] = field(repr=False)

    @cached_property
    def variables(self) -> list[str]:
        """The variables that the conditions read, directly or through the steps, in order."""
        read = self.names_read
        return [name for name in self.domains if name in read]

    @cached_property
    def names_read(self) -> set[str]:
        """Every name that the conditions need."""
        found = {name for condition in self.conditions for name in expr_names(condition)}
        for target, value in reversed(self.assignments):
            if target in found:
                found.update(expr_names(value))
        return found

    @cached_property
    def key(self) -> object:
        """What the question says: two with equal keys have one answer."""
        extents = tuple((name, self.domains[name]) for name in self.variables)
        return (
            self.conditions,
            tuple(self._needed_assignments),
            extents,
            tuple(self._read_parameter_values.items()),
        )

    @cached_property
    def _needed_assignments(self) -> list[SymbolicAssignment]:
        return [(target, value) for target, value in self.assignments if target in self.names_read]

    @cached_property
    def _read_parameter_values(self) -> dict[str, Scalar]:
        return {
            name: value for name, value in self.parameter_values.items() if name in self.names_read
        }

    def holds_at(self, point: Mapping[str, Scalar]) -> bool:
        """Tell whether a point lies within the extents and makes all conditions true."""
        try:
            if not all(self.domains[name].holds(value) for name, value in point.items()):
                return False
            values = {**self._read_parameter_values, **point}
            for target, value in self._needed_assignments:
                values[target] = evaluate(value, values)
            return all(evaluate(condition, values) is True for condition in self.conditions)
        except (KeyError, OverflowError, ValueError):
            return False

    def value_at(self, point: Mapping[str, Scalar], expr: Expr) -> float:
        """Return the value of an expression at a point, after all steps."""
        values = {**self.parameter_values, **point}
        for target, value in self.assignments:
            with suppress(KeyError):  # what the conditions do not need may lack a value
                values[target] = evaluate(value, values)
        return float(evaluate(expr, values))

    def shorten(self, point: Valuation) -> Valuation:
        """Return a point with as few digits as still show what it shows."""
        for digits in DISPLAY_DIGITS:
            shorter: Valuation = {
                name: float(f"{value:.{digits}g}") if isinstance(value, float) else value
                for name, value in point.items()
            }
            if self.holds_at(shorter):
                return shorter
        return point


def format_valuation(point: Mapping[str, Scalar], domains: Mapping[str, VariableDomain]) -> str:
    """Return a point as text: `x = 0.5, ready = true, key = parked`."""
    return ", ".join(
        f"{name.partition('.')[2] or name} = {_format_value(value, domains[name])}"
        for name, value in point.items()
    )


def _format_value(value: Scalar, domain: VariableDomain) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if domain.names:
        return domain.names[int(value)]
    return _format_shortest(float(value))


def _format_shortest(value: float) -> str:
    """Return the shortest text that reads back as the value, without a needless `.0`."""
    return next(text for n in (4, 6, 9, 12, 15, 17) if float(text := f"{value:.{n}g}") == value)
