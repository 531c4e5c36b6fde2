"""Invariant terms: facts as terms of z3, and their evaluation for given numbers."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

from codegen.proofs.infeasible.candidate_invariants import AtMost, Fact, Literal, Same, Within
from codegen.proofs.infeasible.cutpoints import CutpointState
from codegen.proofs.infeasible.float_terms import Limits
from codegen.proofs.infeasible.symbolic_execution import SymbolicProgram
from language.numerics.evaluate import RELATIONS

Number = Fraction | float | int | None
"""A number, or a truth value as 0 or 1; None for a NaN."""


def holds(fact: Fact, of: Callable[[str], Any]) -> bool:
    """Tell whether a fact holds for the numbers that `of` returns for variables."""
    match fact:
        case Within(_, name, limits, where):
            return not _all(where, of) or _is_within(of(name), limits)
        case AtMost(_, name, others, factor, more, going, where):
            more += 0 if not going or of(going) else 1
            most = factor * sum(map(of, others)) + more
            return not _all(where, of) or bool(of(name) <= most)
        case Same(_, name, relation, number, truth, where):
            found, wanted = of(name), of(truth) if isinstance(truth, str) else truth
            other = of(number) if isinstance(number, str) else number
            is_nan = found is None or other is None
            is_so = relation == "!=" if is_nan else RELATIONS[relation](found, other)
            return not _all(where, of) or is_so == bool(wanted)


def _all(where: tuple[Literal, ...], of: Callable[[str], Any]) -> bool:
    return all(of(name) == number for name, number in where)


def _is_within(value: Any, limits: Limits) -> bool:
    if isinstance(limits, frozenset):
        return value in limits
    return value is not None and limits[0] <= value <= limits[1]


def term(world: SymbolicProgram, at: CutpointState, fact: Fact) -> Any:
    """Return a fact for the values at a cutpoint as a term; equal arguments give the same term."""
    key = id(at), fact
    if key not in world.said:
        world.said[key] = _term(world, at, fact), at  # it keeps its number
    return world.said[key][0]


def _term(world: SymbolicProgram, at: CutpointState, fact: Fact) -> Any:
    z3, terms, values = world.z3, world.terms, at.values
    match fact:
        case Within(_, name, limits, where):
            return _where(world, at, where, terms.within(values[name], limits))
        case AtMost(_, name, others, factor, more, going, where):
            most = factor * sum(values[other] for other in others) + more
            found = values[name] <= (most + z3.If(values[going], 0, 1) if going else most)
            return _where(world, at, where, found)
        case Same(_, name, relation, number, truth, where):
            other = values[number] if isinstance(number, str) else terms.value(number)
            found = terms.compare(relation, values[name], other)
            wanted = values[truth] if isinstance(truth, str) else z3.BoolVal(truth)
            return _where(world, at, where, found == wanted)


def _where(
    world: SymbolicProgram, at: CutpointState, where: tuple[Literal, ...], found: Any
) -> Any:
    z3, terms = world.z3, world.terms
    if not where:
        return found
    known = [terms.within(at.values[name], frozenset({number})) for name, number in where]
    return z3.Or(*(z3.Not(one) for one in known), found)
