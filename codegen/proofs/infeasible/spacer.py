"""Reachability: queries to z3's Spacer whether a condition can have an outcome in any step.

Paths between cutpoints are Horn clauses of predicates over the values at cutpoints. Spacer searches
for these predicates from the query (Komuravelli, Gurfinkel and Chaki 2014).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import Any

from codegen.proofs.infeasible.candidate_invariants import Fact
from codegen.proofs.infeasible.cutpoints import ConditionVisit, Cutpoint, CutpointState
from codegen.proofs.infeasible.float_terms import Real
from codegen.proofs.infeasible.houdini import known_at
from codegen.proofs.infeasible.symbolic_execution import SymbolicProgram

EFFORT = 15_000_000
"""Resource limit of z3 for one query: some seconds."""


class Reachability:
    """The Horn clauses of a Program, with facts that are known to hold at its cutpoints."""

    def __init__(self, world: SymbolicProgram, facts: Collection[Fact]) -> None:
        self.world, self.facts, self.z3 = world, facts, world.z3
        self.clauses = self.z3.Fixedpoint()
        self.clauses.set(engine="spacer", rlimit=EFFORT)
        self.predicates = {cut.name: self._predicate(cut) for cut in world.cuts}
        for way in world.ways:
            body = self._all(way.begin, way.given)
            self.clauses.rule(self._closed(self._at(way.end), body))

    def never(self, visits: Sequence[ConditionVisit], outcome: bool) -> bool:
        """Tell whether a condition is proven to have an outcome at none of its visits.

        Returns False also if z3 reaches its resource limit.
        """
        z3 = self.z3
        terms = [v.condition if outcome else z3.Not(v.condition) for v in visits]
        asked = [self._all(v.begin, (*v.given, t)) for v, t in zip(visits, terms, strict=True)]
        try:
            return bool(self.clauses.query(z3.Or(*map(self._open, asked))) == z3.unsat)
        except z3.Z3Exception:  # the effort is spent
            return False

    def _predicate(self, cut: Cutpoint) -> Any:
        values = {name: self.world.terms.new(self.world.kinds[name], name) for name in cut.names}
        sorts = [part.sort() for part in _parts(CutpointState(cut, values))]
        found = self.z3.Function(cut.name, *sorts, self.z3.BoolSort())
        self.clauses.register_relation(found)
        return found

    def _at(self, at: CutpointState) -> Any:
        return self.predicates[at.cut.name](*_parts(at))

    def _all(self, begin: CutpointState | None, given: Sequence[Any]) -> Any:
        """Return all that holds: where a way began, what was given, what is known of it."""
        known = [*given, *known_at(self.world, begin, self.facts)]
        known += self.world.terms.lemmas(known)
        return self.z3.And(*known, *([self._at(begin)] if begin else []))

    def _closed(self, head: Any, body: Any) -> Any:
        clause = self.z3.Implies(body, head)
        free = list(_free(self.z3, clause))
        return self.z3.ForAll(free, clause) if free else clause

    def _open(self, body: Any) -> Any:
        free = list(_free(self.z3, body))
        return self.z3.Exists(free, body) if free else body


def _parts(at: CutpointState) -> Iterator[Any]:
    """Yield what z3 has of the values at a cut."""
    for name in at.cut.names:
        value = at.values[name]
        yield from (value.value, value.nan) if isinstance(value, Real) else (value,)


def _free(z3: Any, term: Any) -> Iterator[Any]:
    """Yield the variables of a term, each once."""
    seen, stack = set[int](), [term]
    while stack:
        part = stack.pop()
        if part.get_id() not in seen:
            seen.add(part.get_id())
            if z3.is_const(part) and part.decl().kind() == z3.Z3_OP_UNINTERPRETED:
                yield part
            stack += part.children()
