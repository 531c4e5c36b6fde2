"""Loop candidates: candidate invariants on counters, edges and guards inside a loop.

A mode that counts the time of its guard has done so after one iteration. If its counter is 0, or
its edge is not present, the guard is false until the loop ends. The number of iterations so far
tells how a mode was reached, which relates two modes, a counter and the guards.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import combinations

from codegen.proofs.infeasible.candidate_invariants import (
    KEPT,
    AtMost,
    Fact,
    Literal,
    Same,
    Within,
    asked_of,
    compared_in,
    ends_of,
    going_values,
    modes_at,
    modes_of,
)
from codegen.proofs.infeasible.cutpoints import Cutpoint, blocks_of
from language.ir.number_type import round_to_type
from language.ir.ops import Assign, Compare, Count, Expr, Op, Ref, Switch, Unary, Value
from language.ir.program import Program
from language.ir.rewrite_ops import direct_expressions, walk_post_order
from language.ir.traversal import walk_ops

Atom = tuple[str, str, float | int | str]
"""A comparison: a variable, a relation, and a number or another variable."""


def loop_invariant_candidates(
    program: Program, cut: Cutpoint, first: Mapping[str, int]
) -> Iterator[Fact]:
    """Yield candidates on the counters and comparisons of modes inside a loop."""
    if cut.loop is None:
        return
    going = going_values(program, first)
    for mode, ops in _followed(program, cut):
        atoms, truths = _asked(program, cut, ops)
        for latch in _latches(cut, ops):
            for one in going:
                where = (mode, one, latch)
                for name, relation, other in atoms:
                    yield from (Same(cut, name, relation, other, t, where) for t in (False, True))
                for name in truths:
                    yield from (Within(cut, name, frozenset({t}), where) for t in (0, 1))


def counted(program: Program, cut: Cutpoint) -> Iterator[Fact]:
    """Yield candidates on modes for each number of iterations so far."""
    counts = counts_of(program, cut)
    modes = modes_at(program, cut)
    for counter, most in counts.items():
        for one, other in combinations(modes, 2):
            if one[0] != other[0]:
                yield from (Within(cut, counter, (0, k), (one, other)) for k in range(most))
                yield from said(program, cut, (one, other), int)
        for k in range(1, most + 1):
            for mode in modes:
                yield from said(program, cut, (mode, (counter, k)))
            for mode, ops in _followed(program, cut):
                where = (mode, (counter, k))
                for timer in _timers(ops):
                    yield from (Within(cut, timer, (0, end), where) for end in (0, 1))


def lasting(
    program: Program, cut: Cutpoint, first: Mapping[str, int], cuts: Iterable[Cutpoint]
) -> Iterator[Fact]:
    """Yield candidates that relate the time in a mode to a counter in another region."""
    going = going_values(program, first)
    followed = [(m, ops) for one in cuts if one.loop for m, ops in _followed(program, one)]
    for mode, ops in followed:
        for time in sorted(_times(ops) & set(cut.names)):
            for beside, others in followed:
                for timer in _timers(others) if beside[0] != mode[0] else ():
                    for where in ((mode, beside), *((mode, beside, one) for one in going)):
                        ahead = (-1, 0, 1)
                        yield from (AtMost(cut, time, (timer,), 1, k, "", where) for k in ahead)


def _times(ops: list[Op]) -> set[str]:
    """Return the times in a mode that guards compare."""
    counted = _timers(ops)
    read = {
        expr.left.name
        for op in ops
        for whole in direct_expressions(op)
        for expr in walk_post_order(whole)
        if isinstance(expr, Compare) and isinstance(expr.left, Ref)
    }
    return {name for name in read - set(counted) if name.startswith("timer.")}


def counts_of(program: Program, cut: Cutpoint) -> dict[str, int]:
    """Return the iteration counters of a loop with their largest values."""
    last = {name for name, _, _ in compared_in(program, cut)}
    return {name: most for name, most in ends_of(program, cut) if name in last}


def commanded(program: Program, cut: Cutpoint, first: Mapping[str, int]) -> Iterator[Fact]:
    """Yield candidates on equations and discrete truth values in a mode and inside a loop."""
    groups = ("equation.", "discrete.")
    truths = [v.name for v in program.variables if v.type == "truth" and v.name in cut.names]
    modes = modes_at(program, cut)
    going = going_values(program, first)
    for name in (name for name in truths if name.startswith(groups)):
        for mode in modes:
            for where in ((mode,), *((mode, one) for one in going)):
                yield from (Within(cut, name, frozenset({t}), where) for t in (0, 1))


def said(
    program: Program, cut: Cutpoint, where: tuple[Literal, ...], kind: type = object
) -> Iterator[Fact]:
    """Yield candidates on comparisons, with numbers of a kind, of variables a loop keeps."""
    for name, relation, number in asked_of(program, cut):
        if isinstance(number, kind):
            yield from (Same(cut, name, relation, number, t, where) for t in (True, False))


def _timers(ops: list[Op]) -> list[str]:
    return sorted({op.timer for op in ops if isinstance(op, Count)})


def _followed(program: Program, cut: Cutpoint) -> Iterator[tuple[Literal, list[Op]]]:
    """Yield modes with all that a loop does in them, of loops that choose by mode."""
    assert cut.loop
    modes = modes_of(program)
    for block in blocks_of(program, cut.loop.body):
        for op in walk_ops(block):
            match op:
                case Switch(selector, cases) if selector in modes and selector in cut.names:
                    for number, case in cases:
                        yield (selector, number), all_of(program, case)


def all_of(program: Program, ops: Iterable[Op]) -> list[Op]:
    """Return some operations and all operations that they run."""
    return [op for block in blocks_of(program, tuple(ops)) for op in walk_ops(block)]


def _latches(cut: Cutpoint, ops: list[Op]) -> list[Literal]:
    """Return what counters and kept truth values may be: 0, and true or false."""
    found: dict[Literal, None] = {}
    for op in ops:
        match op:
            case Count(timer):
                found[timer, 0] = None
            case Assign(name, Unary("not", Ref())) if name.startswith(KEPT):
                found |= {(name, 0): None, (name, 1): None}
    return [latch for latch in found if latch[0] in cut.names]


def _asked(program: Program, cut: Cutpoint, ops: list[Op]) -> tuple[list[Atom], list[str]]:
    """Return what guards of a mode compare, and the truth values that they read."""
    atoms: dict[Atom, None] = {}
    truths: dict[str, None] = {}
    kinds = {v.name: v.type for v in program.variables}
    for expr in _guards(ops):
        match expr:
            case Compare(relation, Ref(name), other) if name in cut.names:
                what = _other(program, cut, other)
                if what is not None:
                    atoms[name, relation, what] = None
            case Ref(name) if kinds.get(name) == "truth" and name in cut.names:
                truths[name] = None
    return list(atoms), list(truths)


def _guards(ops: list[Op]) -> Iterator[Expr]:
    """Yield what is asked by counters, and what becomes a level."""
    for op in ops:
        if isinstance(op, Count) or (isinstance(op, Assign) and isinstance(op.value, Compare)):
            for expr in direct_expressions(op):
                yield from walk_post_order(expr)


def _other(program: Program, cut: Cutpoint, expr: Expr) -> float | int | str | None:
    match expr:
        case Value(int(number)):
            return number
        case Value(float(number)):
            return round_to_type(number, program.number_type)
        case Unary("-", Value(float(number))):
            return -round_to_type(number, program.number_type)
        case Ref(name) if name in cut.names:
            return name
    return None
