"""Backend for z3 (de Moura and Bjorner 2008): exact answers to queries over the reals.

A function without a theory (`sin`, `exp`, tables) is uninterpreted within its bounds, so "never"
holds for the real function too. The effort is limited by the resource count of z3 and not by a
clock, so the answers are equal on every machine. z3 is imported with the first query. All terms are
in one context, which is not thread-safe; a lock serialises the queries.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping
from fractions import Fraction
from functools import cached_property
from typing import Any, Literal

from language.ir.ops import Binary, Call, Compare, Expr, Ref, Select, Unary, Value
from language.numerics.evaluate import ARITHMETIC, RELATIONS, Scalar
from language.smt.query import SolverQuery, Valuation, VariableDomain

RESOURCE_LIMIT = 200_000
"""z3 resource units for a proof that decides whether a spec is accepted: seconds at most."""
SMALL_RESOURCE_LIMIT = 10_000
"""z3 resource units for a warning: at most a tenth of a second.

Linear queries take a tenth of that.
"""
IRRATIONAL_DIGITS = 20
"""Decimal digits of an approximated irrational number: more than a double has."""
FUNCTION_BOUNDS: Mapping[str, tuple[float, float]] = {
    "sin": (-1.0, 1.0),
    "cos": (-1.0, 1.0),
    "tanh": (-1.0, 1.0),
    "atan2": (-math.pi, math.pi),
    "exp": (0.0, math.inf),
    "pow": (0.0, math.inf),
    "log": (-708.4, 709.8),
}
"""Bounds of functions that z3 has no theory of."""

Verdict = Literal["never", "open"]
"""Answer without values: the conditions are disproved ("never") or undecided ("open")."""


class UnsupportedExpressionError(Exception):
    """Error of an expression that has no counterpart in z3."""


class Solver:
    """z3 with cached terms; a lock serialises the queries of threads.

    Queries are independent of each other.
    """

    def __init__(self) -> None:
        """Create the lock; z3 is imported with the first query."""
        self._lock = threading.Lock()

    @cached_property
    def z3(self) -> Any:
        """The module z3, imported at the first access; the import takes a fifth of a second."""
        import z3

        return z3

    @cached_property
    def term_cache(self) -> dict[object, Any]:
        """Cached z3 literals by number, and variables with their facts by name and domain.

        It is empty at first and never cleared; the construction of terms takes most of the time.
        """
        return {}

    def solve(
        self, query: SolverQuery, resource_limit: int = RESOURCE_LIMIT
    ) -> Valuation | Verdict:
        """Return rounded values of a solution, "never" if there is none, or "open" if undecided.

        Values are bool, int or float, for the variables that the conditions or their assignments
        read; whether they hold after rounding is not checked. "open" is returned at
        `resource_limit` and for an expression without a counterpart in z3. Nothing is raised.
        """
        with self._lock:
            return self._solve_locked(query, resource_limit)

    def _solve_locked(self, query: SolverQuery, resource_limit: int) -> Valuation | Verdict:
        """Return the answer to a query; the caller holds the lock.

        The terms are released before another thread continues. An expression without a counterpart
        in z3 gives "open".
        """
        solver = self.z3.Solver()
        solver.set("rlimit", resource_limit)
        try:
            terms = _TermBuilder(self.z3, query, self.term_cache)
            conditions = [terms.build(condition) for condition in query.conditions]
        except (UnsupportedExpressionError, self.z3.Z3Exception):
            return "open"
        solver.add(*conditions, *terms.facts)
        answer = solver.check()
        if answer == self.z3.unsat:
            return "never"
        if answer != self.z3.sat:
            return "open"
        model = solver.model()
        return {name: _model_value(model, terms.variables[name]) for name in terms.variables}


def _model_value(model: Any, variable: Any) -> Scalar:
    """Return the value of a variable in a z3 model as bool, int or rounded float."""
    value = model.eval(variable, model_completion=True)
    if variable.sort().name() == "Bool":
        return str(value) == "True"
    if variable.is_int():
        return int(value.as_long())
    exact = value if hasattr(value, "numerator_as_long") else value.approx(IRRATIONAL_DIGITS)
    return float(Fraction(exact.numerator_as_long(), exact.denominator_as_long()))


class _TermBuilder:
    """Builder of z3 terms of one query; `facts` are the constraints of domains and functions."""

    def __init__(self, z3: Any, query: SolverQuery, term_cache: dict[object, Any]) -> None:
        self.z3 = z3
        self.term_cache = term_cache
        self.query = query
        self.variables: dict[str, Any] = {}
        self.facts: list[Any] = []
        self.terms_by_name: dict[str, Any] = {}
        self.roots: dict[int, Any] = {}
        read = query.names_read
        for target, value in query.assignments:
            if target in read:
                self.terms_by_name[target] = self.build(value)

    def build(self, expr: Expr) -> Any:
        """Return the z3 term of an expression.

        Raises UnsupportedExpressionError if there is none.
        """
        z3 = self.z3
        match expr:
            case Value(value):
                return self._literal(value)
            case Ref(name):
                return self._term_of_name(name)
            case Unary("-", operand):
                return -self.build(operand)
            case Unary("not", operand):
                return z3.Not(self.build(operand))
            case Binary("and", left, right):
                return z3.And(self.build(left), self.build(right))
            case Binary("or", left, right):
                return z3.Or(self.build(left), self.build(right))
            case Binary(operator, left, right):
                return ARITHMETIC[operator](self.build(left), self.build(right))
            case Compare(operator, left, right):
                return RELATIONS[operator](self.build(left), self.build(right))
            case Select(condition, then, other):
                return z3.If(self.build(condition), self.build(then), self.build(other))
            case Call(function, arguments):
                return self._build_call(function, arguments)
        raise UnsupportedExpressionError

    def _literal(self, value: Scalar) -> Any:
        """Return a number as a z3 literal.

        Raises UnsupportedExpressionError if it is not finite.
        """
        if isinstance(value, bool):
            return self.z3.BoolVal(value)
        if isinstance(value, int):
            return self.z3.IntVal(value)
        if not math.isfinite(value):
            raise UnsupportedExpressionError
        return self._exact(Fraction(value))

    def _exact(self, value: Fraction) -> Any:
        """Return the cached z3 literal of a rational number."""
        if value not in self.term_cache:
            self.term_cache[value] = self.z3.RealVal(f"{value.numerator}/{value.denominator}")
        return self.term_cache[value]

    def _term_of_name(self, name: str) -> Any:
        """Return the term of an assigned name, a variable or a scalar constant.

        Raises UnsupportedExpressionError for other names.
        """
        if name not in self.terms_by_name:
            if name in self.query.domains:
                self.terms_by_name[name] = self._variable(name, self.query.domains[name])
            elif isinstance(self.query.parameter_values.get(name), float | int | bool):
                self.terms_by_name[name] = self._literal(self.query.parameter_values[name])
            else:
                raise UnsupportedExpressionError
        return self.terms_by_name[name]

    def _variable(self, name: str, domain: VariableDomain) -> Any:
        """Return the cached term of a variable and add the facts of its domain."""
        key = name, domain
        if key not in self.term_cache:
            self.term_cache[key] = self._declare_variable(name, domain)
        self.variables[name], facts = self.term_cache[key]
        self.facts += facts
        return self.variables[name]

    def _declare_variable(self, name: str, domain: VariableDomain) -> tuple[Any, list[Any]]:
        """Return a new variable and the constraints of its domain."""
        z3 = self.z3
        term = {"real": z3.Real, "whole": z3.Int, "truth": z3.Bool}[domain.type](name)
        facts = []
        if domain.low is not None:
            facts.append(term >= self._exact(domain.low))
        if domain.high is not None:
            facts.append(term <= self._exact(domain.high))
        if domain.numbers:
            facts.append(z3.Or(*(term == number for number in domain.numbers)))
        return term, facts

    def _build_call(self, function: str, arguments: tuple[Expr, ...]) -> Any:
        """Return the z3 term of a function call.

        A function without a theory is an uninterpreted function within its bounds.
        """
        z3 = self.z3
        if function in ("lookup", "lookup2"):
            count = 1 if function == "lookup" else 2
            return self._lookup(arguments[-1 - count], arguments[-count:])
        terms = [self.build(argument) for argument in arguments]
        first = terms[0]
        match function:
            case "real":
                return z3.ToReal(first)
            case "whole":
                return z3.ToInt(first)
            case "floor":
                return z3.ToReal(z3.ToInt(first))
            case "abs":
                return z3.If(first >= 0, first, -first)
            case "sign":
                return z3.If(first > 0, z3.RealVal(1), z3.If(first < 0, z3.RealVal(-1), 0))
            case "min":
                return z3.If(terms[1] < first, terms[1], first)
            case "max":
                return z3.If(terms[1] > first, terms[1], first)
            case "clip":
                low, high = terms[1:]
                return z3.If(first > low, z3.If(first < high, first, high), low)
            case "sqrt":
                return self._square_root(first)
        low, high = FUNCTION_BOUNDS.get(function, (-math.inf, math.inf))
        return self._uninterpreted(function, terms, low, high)

    def _square_root(self, square: Any) -> Any:
        """Return a non-negative number whose square is the operand if the operand is not negative.

        Equal operands share one root.
        """
        if square.get_id() not in self.roots:
            root = self.z3.FreshReal("sqrt")
            self.roots[square.get_id()] = root
            self.facts += [root >= 0, self.z3.Implies(square >= 0, root * root == square)]
        return self.roots[square.get_id()]

    def _lookup(self, table: Expr, arguments: tuple[Expr, ...]) -> Any:
        """Return a lookup as an uninterpreted function within the smallest and largest table value.

        Raises UnsupportedExpressionError if the table has no values.
        """
        items = self.query.parameter_values.get(table.name) if isinstance(table, Ref) else None
        if not isinstance(table, Ref) or not isinstance(items, tuple):
            raise UnsupportedExpressionError
        terms = [self.build(argument) for argument in arguments]
        return self._uninterpreted(f"lookup {table.name}", terms, min(items), max(items))

    def _uninterpreted(self, function: str, terms: list[Any], low: float, high: float) -> Any:
        """Return an uninterpreted function of real terms; finite bounds are added as facts."""
        z3 = self.z3
        term = z3.Function(function, *[z3.RealSort()] * (len(terms) + 1))(*terms)
        if math.isfinite(low):
            self.facts.append(term >= self._literal(low))
        if math.isfinite(high):
            self.facts.append(term <= self._literal(high))
        return term
