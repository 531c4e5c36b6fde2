"""Inquiry: the answers to questions about one automaton - a witness, never, or open.

First a few sample points are tried, which answers most questions in no time; then z3 is asked. Its
witnesses too are told only where our own arithmetic says the same.
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
from language.lowering.parameter_bindings import parameter_kinds
from language.model.automaton import Automaton
from language.model.declaration import Input, Parameter, State
from language.numerics.evaluate import Scalar
from language.smt.guard_snapshot import SymbolicPath
from language.smt.linear_bounds import narrow_domains
from language.smt.query import (
    SolverQuery,
    SymbolicAssignment,
    Valuation,
    VariableDomain,
    format_valuation,
)
from language.smt.sample_points import all_sample_points, first_sample_points, neighbouring_points
from language.smt.z3_backend import SMALL_RESOURCE_LIMIT, Solver, Verdict
from language.text.diagnostic import Problems

MAX_SEARCHED_POINTS = 20_000
"""Points tried of all questions that z3 leaves open: a second or two."""
MAX_SOLVER_QUERIES = 4000
"""Questions for z3 of one check; beyond they stay open."""


@dataclass(frozen=True)
class Witness:
    """Values at which all conditions of a question hold, as our own arithmetic says."""

    valuation: Valuation
    text: str

    @property
    def hint_prefix(self) -> str:
        """How a help begins: `at x = 0.5; `, empty where no value that is told matters."""
        return f"at {self.text}; " if self.text else ""


class QueryEngine:
    """Asks about one automaton; parameters have their present values unless they are free."""

    def __init__(self, automaton: Automaton) -> None:
        """Find what every variable can be."""
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
        """Return the question whether some conditions can hold together in a story."""
        extents = {**self.domains, **path.domains}
        together = (*conditions, *path.assumptions)
        return SolverQuery(together, tuple(path.assignments), extents, self.parameter_values)

    def free_tunables(self, query: SolverQuery) -> SolverQuery | None:
        """Return the question with all values that tunables can have, None if it reads none."""
        wider = replace(
            query,
            assignments=(*self.derived_assignments, *query.assignments),
            domains={**query.domains, **self.tunable_domains},
        )
        return wider if any(name in wider.names_read for name in self.tunable_domains) else None

    def answer(self, query: SolverQuery) -> Witness | Verdict:
        """Return a witness, "never", or "open"."""
        narrower = narrow_domains(query)
        if narrower is None:
            return "never"
        found = next(filter(query.holds_at, first_sample_points(query, narrower)), None)
        if found is None:
            decided = self._solve(query)
            if isinstance(decided, str) and decided == "never":
                return decided
            found = self._search_points(query) if isinstance(decided, str) else decided
        return _build_witness(query, found) if found else "open"

    def answer_for_all_tunables(self, query: SolverQuery) -> Witness | Verdict:
        """Return the answer for all values that tunables can have, the present ones first."""
        found = self.answer(query)
        wider = self.free_tunables(query) if found == "never" else None
        return self.answer(wider) if wider else found

    def is_unsatisfiable(self, query: SolverQuery) -> bool:
        """Tell whether it is proven that conditions never hold together, tunables being any."""
        self.query_count += 1
        if self.query_count > MAX_SOLVER_QUERIES or not _is_proven_unsatisfiable(
            QueryKey(query.key, query)
        ):
            return False
        wider = self.free_tunables(query)
        return wider is None or _is_proven_unsatisfiable(QueryKey(wider.key, wider))

    def find_confirmed_witness(self, exact: SolverQuery, near: SolverQuery) -> Witness | None:
        """Return a witness that z3 finds for a question, and that holds for one near to it."""
        self.query_count += 1
        if self.query_count > MAX_SOLVER_QUERIES or narrow_domains(exact) is None:
            return None
        found = shared_solver().solve(exact, SMALL_RESOURCE_LIMIT)
        return (
            _build_witness(near, found)
            if not isinstance(found, str) and near.holds_at(found)
            else None
        )

    def _solve(self, query: SolverQuery) -> Valuation | Verdict:
        """Return a witness that z3 finds and our own arithmetic confirms, or what z3 says."""
        self.query_count += 1
        found = shared_solver().solve(query) if self.query_count <= MAX_SOLVER_QUERIES else "open"
        if isinstance(found, str):
            return found
        return next(
            (point for point in neighbouring_points(found, query) if query.holds_at(point)), "open"
        )

    def _search_points(self, query: SolverQuery) -> Valuation | None:
        """Return a witness among many points, as long as not too many were tried in all."""
        for point in all_sample_points(query):
            self.point_count += 1
            if self.point_count > MAX_SEARCHED_POINTS:
                return None
            if query.holds_at(point):
                return point
        return None


@dataclass(frozen=True)
class QueryKey:
    """A question by what it says: the same one, asked again, has its answer already."""

    key: object
    query: SolverQuery = field(compare=False)


@lru_cache(maxsize=2048)
def _is_proven_unsatisfiable(query_key: QueryKey) -> bool:
    """Tell whether conditions are proven never to hold together."""
    question = query_key.query
    narrower = narrow_domains(question)
    if narrower is None:
        return True
    if any(question.holds_at(point) for point in first_sample_points(question, narrower)):
        return False
    return shared_solver().solve(question, SMALL_RESOURCE_LIMIT) == "never"


@cache
def shared_solver() -> Solver:
    """Return the one solver: what it has made of names and numbers is of use again."""
    return Solver()


def _build_witness(query: SolverQuery, valuation: Valuation) -> Witness:
    shorter = query.shorten(valuation)
    shown_values = {
        name: value for name, value in shorter.items() if not name.startswith("memory.")
    }
    return Witness(shorter, format_valuation(shown_values, query.domains))


def _declared_domains(automaton: Automaton) -> Iterator[tuple[str, VariableDomain]]:
    for name, thing in automaton.inputs.items():
        extent = _declared_domain(thing, automaton.numbers)
        if thing.default is not None:
            default: Scalar = round_to_type(thing.default, automaton.numbers)
            extent = replace(extent, default=_cast_to_domain(default, extent))
        yield f"input.{name}", extent
    for name, variable in automaton.state_variables.items():
        yield storage_of(automaton, name), _declared_domain(variable, automaton.numbers)


def _cast_to_domain(value: Scalar, domain: VariableDomain) -> Scalar:
    if domain.type == "truth":
        return bool(value)
    return int(value) if domain.type == "whole" else value


def _declared_domain(declaration: Input | State | Parameter, numbers: NumberType) -> VariableDomain:
    """Return what a declared thing can be, with its bounds as a program has them."""
    if declaration.type == "enum":
        places = tuple(range(len(declaration.values)))
        return VariableDomain("whole", numbers=places, names=declaration.values)
    bounds = [Fraction(round_to_type(bound, numbers)) for bound in declaration.range or ()]
    low, high = bounds or (None, None)
    return VariableDomain(value_type(declaration.type), low, high)
