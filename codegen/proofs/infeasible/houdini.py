"""Houdini: the largest inductive subset of the candidate invariants of a Program.

A candidate that does not hold at the end of a path, if all hold at its begin, is removed until the
others do (Houdini, Flanagan and Leino 2001).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from fractions import Fraction
from functools import cache
from typing import Any

from codegen.proofs.infeasible.candidate_invariants import Fact, Within, propose_facts
from codegen.proofs.infeasible.cutpoints import Cutpoint, CutpointState, ExecutionPath
from codegen.proofs.infeasible.float_terms import Range, Real
from codegen.proofs.infeasible.invariant_terms import Number, holds, term
from codegen.proofs.infeasible.loop_candidates import (
    commanded,
    counted,
    lasting,
    loop_invariant_candidates,
)
from codegen.proofs.infeasible.queue_candidates import queue_candidates
from codegen.proofs.infeasible.symbolic_execution import SymbolicProgram

EFFORT = 20_000_000
"""Resource limit of z3 for one query: some seconds, and the same result on every machine."""
MOST_WHERE, MOST_TRIED = 2, 12_000
"""Maximum number of conditions of a fact, and of facts that are tried together (about a minute)."""


def find_invariants(
    world: SymbolicProgram, ranges: Mapping[str, Range], most_where: int = MOST_WHERE
) -> list[Fact]:
    """Return the facts that hold at the cutpoints of a Program.

    `ranges` gives the ranges in which variables stay between two steps. Facts have at most
    `most_where` conditions. Facts with few conditions are proven first and assumed for the others.
    Facts with more conditions are left out if there are more than MOST_TRIED of them.
    """
    facts = list(dict.fromkeys(propose_facts(world.program, world.cuts, ranges)))
    last = list(dict.fromkeys(_last(world)))
    known: list[Fact] = []
    for most in range(most_where + 2):
        some = [f for f in facts if len(f.where) <= most]
        fresh = list(_beside(some if most <= most_where else last, known))
        if len(fresh) > MOST_TRIED:
            break
        known = list(_strongest([*known, *_staying(world, fresh, known)]))
    return known


def _last(world: SymbolicProgram) -> Iterator[Fact]:
    """Yield what is proposed at last, together: what a loop counts hangs on what modes command."""
    if not any(cut.loop for cut in world.cuts):
        return
    for cut, first in world.cuts.items():
        yield from commanded(world.program, cut, first)
        yield from lasting(world.program, cut, first, world.cuts)
        if cut.loop:
            yield from loop_invariant_candidates(world.program, cut, first)
            yield from counted(world.program, cut)
            yield from queue_candidates(world.program, cut, first)


def _staying(
    world: SymbolicProgram, tried: Collection[Fact], known: Collection[Fact]
) -> list[Fact]:
    """Return the largest part of what is tried that stays, where some facts are known."""
    facts = dict.fromkeys(tried)
    asking = [_Asking(world, way, facts, known) for way in world.ways]
    lost = {fact for one in asking for fact in one.lost(facts)}
    while lost:
        facts = {fact: None for fact in facts if fact not in lost}
        lost = {fact for one in asking for fact in one.lost(facts)}
    return list(facts)


def _beside(some: Iterable[Fact], known: Collection[Fact]) -> Iterator[Fact]:
    """Yield those facts that known ones do not say already."""
    said = _by_variable(known)
    for fact in some:
        others = said.get((fact.cut, fact.name), ())
        if fact not in others and not any(_says(one, fact) for one in others):
            yield fact


def _strongest(facts: Collection[Fact]) -> Iterator[Fact]:
    """Yield those facts that no other one says already."""
    by_variable = _by_variable(facts)
    for fact in facts:
        if not any(_says(one, fact) for one in by_variable[fact.cut, fact.name]):
            yield fact


def _by_variable(facts: Iterable[Fact]) -> dict[tuple[Cutpoint, str], list[Fact]]:
    found: dict[tuple[Cutpoint, str], list[Fact]] = {}
    for fact in facts:
        found.setdefault((fact.cut, fact.name), []).append(fact)
    return found


def _says(one: Fact, other: Fact) -> bool:
    """Tell whether a fact of a variable says more than another one of it."""
    if not (isinstance(one, Within) and isinstance(other, Within)) or one == other:
        return False
    if not set(one.where) <= set(other.where):
        return False
    if isinstance(one.limits, frozenset) and isinstance(other.limits, frozenset):
        return one.limits <= other.limits
    if isinstance(one.limits, tuple) and isinstance(other.limits, tuple):
        return other.limits[0] <= one.limits[0] and one.limits[1] <= other.limits[1]
    return False


def known_at(
    world: SymbolicProgram, at: CutpointState | None, facts: Collection[Fact]
) -> list[Any]:
    """Return the terms of some facts for the values at a cutpoint."""
    if at is None:
        return []
    return [term(world, at, fact) for fact in facts if fact.cut is at.cut]


def is_never(world: SymbolicProgram, facts: list[Any]) -> bool:
    """Tell whether z3 proves that some terms are never true together."""
    solver = world.z3.Solver()
    solver.set("rlimit", EFFORT)
    solver.add(*facts, *world.terms.lemmas(facts))
    return bool(solver.check() == world.z3.unsat)


class _Asking:
    """A way with all that was proposed where it begins, and where it ends."""

    def __init__(
        self,
        world: SymbolicProgram,
        way: ExecutionPath,
        facts: Collection[Fact],
        known: Collection[Fact],
    ) -> None:
        z3 = self.z3 = world.z3
        self.world, self.end, begin = world, way.end, way.begin
        begun = (fact for fact in facts if begin and fact.cut is begin.cut)
        self.begun = {fact: term(world, begin, fact) for fact in begun if begin}
        ended = [fact for fact in facts if fact.cut is way.end.cut]
        self.asked = {fact: z3.Bool(f"asked {k}") for k, fact in enumerate(ended)}
        wrong = [z3.And(a, z3.Not(term(world, way.end, f))) for f, a in self.asked.items()]
        told = [*way.given, *known_at(world, begin, known), z3.Or(*wrong)]
        self.told = [*told, *world.terms.lemmas(told)]

    def lost(self, facts: Collection[Fact]) -> set[Fact]:
        """Return those facts that are not proven where the way ends."""
        z3, found = self.z3, set[Fact]()
        left = {fact: asked for fact, asked in self.asked.items() if fact in facts}
        solver = z3.Solver()
        solver.set("rlimit", EFFORT)
        solver.add(*self.told, *(begun for fact, begun in self.begun.items() if fact in facts))
        solver.add(*(z3.Not(asked) for fact, asked in self.asked.items() if fact not in left))
        while left and (told := solver.check()) != z3.unsat:
            if told != z3.sat:
                return found | set(left)
            number = _read(self.world, self.end, solver.model())
            gone = {fact for fact in left if not holds(fact, number)}
            assert gone, "a model that refutes a fact"
            found |= gone
            solver.add(*(z3.Not(left.pop(fact)) for fact in gone))
        return found


def _read(world: SymbolicProgram, at: CutpointState, model: Any) -> Callable[[str], Number]:
    """Return what gives the number that a variable has in a model."""

    @cache
    def number(name: str) -> Number:
        value = at.values[name]
        if not isinstance(value, Real):
            return world.terms.number_of(model.eval(value, True))
        if world.z3.is_true(model.eval(value.nan, True)):
            return None
        found: Fraction = model.eval(value.value, True).as_fraction()
        return found

    return number
