"""Query engine: answers queries about one automaton with a witness, "never" or "open".

Linear bounds and a few sample points decide most queries; z3 decides the others. A witness of z3 is
reported only if the arithmetic of this project confirms it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cache, lru_cache

from language.ir.number_type import NumberType, round_to_type
from language.ir.ops import Assign, Expr
from language.ir.program import value_type
from language.lowering.action_stages import storage_of
from language.lowering.constants import constant_values, derive_block, parameter_constants
from language.lowering.program_parameters import parameter_kinds
from language.model.automaton import Automaton
from language.model.declaration import Input, Parameter, State
from language.numerics.evaluate import Scalar
from language.smt.bound_propagation import narrow_domains
from language.smt.query import (
    SolverQuery,
    SymbolicAssignment,
    Valuation,
    VariableDomain,
    format_valuation,
)
from language.smt.sample_points import all_sample_points, first_sample_points, neighbouring_points
from language.smt.symbolic_environment import SymbolicPath
from language.smt.z3_backend import SMALL_RESOURCE_LIMIT, Solver, Verdict
from language.text.diagnostic import Problems

MAX_SEARCHED_POINTS = 20_000
"""Largest number of points tried for all queries that z3 leaves open: one or two seconds."""
MAX_SOLVER_QUERIES = 4000
"""Largest number of z3 queries of one check; further queries remain open."""


@dataclass(frozen=True)
class Witness:
    """Values at which all conditions of a query hold, confirmed by evaluation.

    `text` is their display form, without the state of functions with memory.
    """

    valuation: Valuation
    text: str

    @property
    def hint_prefix(self) -> str:
        """Start of a hint, `at x = 0.5; `; "" if there is no value to show."""
        return f"at {self.text}; " if self.text else ""


class QueryEngine:
    """Builder and solver of the queries about one automaton.

    Parameters have their present values unless a query frees the tunable ones.
    """

    def __init__(self, automaton: Automaton) -> None:
        """Compute the domains of inputs, states, discrete variables and tunable parameters.

        A domain is the declared range, rounded to the number type, or the indices of an
        enumeration. Tunable lookup tables have none. The limits of queries and points count for one
        engine.
        """
        self.automaton = automaton
        self.query_count = self.point_count = 0
        self.parameter_values = constant_values(parameter_constants(automaton, Problems()))
        self.domains = dict(_declared_domains(automaton))
        self.tunable_domains = {
            f"calibration.{name}": _declared_domain(automaton.parameters[name], automaton.numbers)
            for name, kind in parameter_kinds(automaton).items()
            if kind == "tunable" and not automaton.parameters[name].table
        }
        self.derived_assignments: list[SymbolicAssignment] = [
            (op.target, op.value) for op in derive_block(automaton) if isinstance(op, Assign)
        ]

    def build_query(self, path: SymbolicPath, conditions: Iterable[Expr]) -> SolverQuery:
        """Return the query whether conditions can hold together after the assignments of a path.

        The assumptions of the path are added to the conditions, its domains to those of the
        automaton. Parameters have their present values.
        """
        domains = {**self.domains, **path.domains}
        all_conditions = (*conditions, *path.assumptions)
        return SolverQuery(all_conditions, tuple(path.assignments), domains, self.parameter_values)

    def free_tunables(self, query: SolverQuery) -> SolverQuery | None:
        """Return the query with tunable parameters as variables; None if it depends on none.

        The assignments of derived parameters are put before those of the query. Tunable lookup
        tables keep their values.
        """
        wider = replace(
            query,
            assignments=(*self.derived_assignments, *query.assignments),
            domains={**query.domains, **self.tunable_domains},
        )
        return wider if any(name in wider.names_read for name in self.tunable_domains) else None

    def answer(self, query: SolverQuery) -> Witness | Verdict:
        """Return a witness, "never" if the conditions are disproved, or "open".

        The methods are tried in this order: linear bounds, `first_sample_points`, z3 (at most
        MAX_SOLVER_QUERIES in this engine), and if z3 finds no confirmed solution
        `all_sample_points` (at most MAX_SEARCHED_POINTS). The witness of a query without variables
        is empty.
        """
        narrower = narrow_domains(query)
        if narrower is None:
            return "never"
        valuation = next(filter(query.holds_at, first_sample_points(query, narrower)), None)
        if valuation is None:
            decided = self._solve(query)
            if isinstance(decided, str) and decided == "never":
                return decided
            valuation = self._search_points(query) if isinstance(decided, str) else decided
        return "open" if valuation is None else _build_witness(query, valuation)

    def answer_for_all_tunables(self, query: SolverQuery) -> Witness | Verdict:
        """Return the answer for the present values of tunable parameters.

        If that is "never" and the query depends on tunable parameters, return the answer for all
        values in their ranges instead.
        """
        answer = self.answer(query)
        wider = self.free_tunables(query) if answer == "never" else None
        return self.answer(wider) if wider else answer

    def is_proven_unsatisfiable(self, query: SolverQuery) -> bool:
        """Return whether it is proven that the conditions never hold, for all tunable values.

        Proofs are linear bounds or z3 with SMALL_RESOURCE_LIMIT; answers are cached. The result is
        False if nothing is proven, and once MAX_SOLVER_QUERIES is exceeded.
        """
        self.query_count += 1
        if self.query_count > MAX_SOLVER_QUERIES or not _is_proven_unsatisfiable(
            QueryKey(query.key, query)
        ):
            return False
        wider = self.free_tunables(query)
        return wider is None or _is_proven_unsatisfiable(QueryKey(wider.key, wider))

    def find_confirmed_witness(self, exact: SolverQuery, relaxed: SolverQuery) -> Witness | None:
        """Return a solution of the first query by z3 that satisfies the second one, else None.

        The second query is the first with equalities relaxed to a tolerance, because solutions are
        rounded. z3 has SMALL_RESOURCE_LIMIT, and sample points are not tried. The result is None,
        too, once MAX_SOLVER_QUERIES is exceeded.
        """
        self.query_count += 1
        if self.query_count > MAX_SOLVER_QUERIES or narrow_domains(exact) is None:
            return None
        solution = shared_solver().solve(exact, SMALL_RESOURCE_LIMIT)
        return (
            _build_witness(relaxed, solution)
            if not isinstance(solution, str) and relaxed.holds_at(solution)
            else None
        )

    def _solve(self, query: SolverQuery) -> Valuation | Verdict:
        """Return a solution of z3 that evaluation confirms, "never", or "open"."""
        self.query_count += 1
        solution = (
            shared_solver().solve(query) if self.query_count <= MAX_SOLVER_QUERIES else "open"
        )
        if isinstance(solution, str):
            return solution
        return next(
            (point for point in neighbouring_points(solution, query) if query.holds_at(point)),
            "open",
        )

    def _search_points(self, query: SolverQuery) -> Valuation | None:
        """Return the first of many sample points at which the query holds; None if there is none.

        The search ends when `MAX_SEARCHED_POINTS` points were tried in all queries of this engine.
        """
        for point in all_sample_points(query):
            self.point_count += 1
            if self.point_count > MAX_SEARCHED_POINTS:
                return None
            if query.holds_at(point):
                return point
        return None


@dataclass(frozen=True)
class QueryKey:
    """Query that is compared and hashed by its key, for the cache of answers."""

    key: object
    query: SolverQuery = field(compare=False)


@lru_cache(maxsize=2048)
def _is_proven_unsatisfiable(query_key: QueryKey) -> bool:
    """Return whether linear bounds or z3 prove that the conditions never hold together."""
    query = query_key.query
    narrower = narrow_domains(query)
    if narrower is None:
        return True
    if any(query.holds_at(point) for point in first_sample_points(query, narrower)):
        return False
    return shared_solver().solve(query, SMALL_RESOURCE_LIMIT) == "never"


@cache
def shared_solver() -> Solver:
    """Return the solver of this process, created at the first call.

    It reuses the terms of names and numbers, and a lock serialises its queries.
    """
    return Solver()


def _build_witness(query: SolverQuery, valuation: Valuation) -> Witness:
    """Return a witness with rounded values.

    Its text leaves out the state of functions with memory.
    """
    shorter = query.shorten(valuation)
    shown_values = {
        name: value for name, value in shorter.items() if not name.startswith("memory.")
    }
    return Witness(shorter, format_valuation(shown_values, query.domains))


def _declared_domains(automaton: Automaton) -> Iterator[tuple[str, VariableDomain]]:
    """Yield the storage name and domain of each input, state and discrete variable.

    The default of an input is the default of its domain.
    """
    for name, declaration in automaton.inputs.items():
        domain = _declared_domain(declaration, automaton.numbers)
        if declaration.default is not None:
            default: Scalar = round_to_type(declaration.default, automaton.numbers)
            domain = replace(domain, default=_cast_to_domain(default, domain))
        yield f"input.{name}", domain
    for name, variable in automaton.state_variables.items():
        yield storage_of(automaton, name), _declared_domain(variable, automaton.numbers)


def _cast_to_domain(value: Scalar, domain: VariableDomain) -> Scalar:
    """Return a number as bool or int if the domain has that type."""
    if domain.type == "truth":
        return bool(value)
    return int(value) if domain.type == "whole" else value


def _declared_domain(declaration: Input | State | Parameter, numbers: NumberType) -> VariableDomain:
    """Return the domain of a declaration.

    An enumeration has the indices of its values; other types have their range, rounded to the
    number type.
    """
    if declaration.type == "enum":
        places = tuple(range(len(declaration.values)))
        return VariableDomain("whole", numbers=places, names=declaration.values)
    bounds = [Fraction(round_to_type(bound, numbers)) for bound in declaration.range or ()]
    low, high = bounds or (None, None)
    return VariableDomain(value_type(declaration.type), low, high)
