"""Infeasible conditions: proofs that no input gives a condition of a sampled Program an outcome.

A step is executed symbolically from cutpoint to cutpoint (`cutpoints.py`, `symbolic_execution.py`,
`float_terms.py`). It begins with any values that the invariants allow (`candidate_invariants.py`,
`houdini.py`), with any inputs, and with any page within its ranges. An outcome that invariants do
not exclude is a query to z3's Spacer, which finds further invariants (`spacer.py`).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import partial
from typing import Any

from codegen.emit.c_expression import LOGICAL_OPERATORS, emit_expression
from codegen.emit.c_names import SOLVED_PREFIX_ON_PAGE, CNames
from codegen.emit.c_statement import split_loop_guard
from codegen.passes.block_usage import locals_of
from codegen.proofs.infeasible.candidate_invariants import Fact
from codegen.proofs.infeasible.cutpoints import ConditionVisit
from codegen.proofs.infeasible.float_terms import Range
from codegen.proofs.infeasible.houdini import find_invariants, is_never, known_at
from codegen.proofs.infeasible.spacer import Reachability
from codegen.proofs.infeasible.symbolic_execution import SymbolicProgram
from language.ir.ops import Assign, Binary, Branch, Count, Expr, Loop, Op, Select, Unary
from language.ir.program import Program
from language.ir.rewrite_ops import direct_expressions, walk_post_order
from language.ir.traversal import negate_condition, walk_ops


@dataclass(frozen=True)
class DecisionSite:
    """A decision of the C: its block, its text, and the numbers of its conditions."""

    block: str
    text: str
    conditions: tuple[int, ...]


def unshare_expressions(program: Program) -> Program:
    """Return a Program in which each expression is a separate object with its own `id`."""
    return replace(program, blocks={name: _own(block) for name, block in program.blocks.items()})


def _own(thing: Any) -> Any:
    if isinstance(thing, tuple):
        return tuple(map(_own, thing))
    if is_dataclass(thing) and not isinstance(thing, type):
        return replace(thing, **{f.name: _own(getattr(thing, f.name)) for f in fields(thing)})
    return thing


def decision_sites(program: Program) -> Iterator[DecisionSite]:
    """Yield the decisions of a Program, after the C passes, that exist in C unchanged."""
    local = locals_of(program)
    for name, block in program.blocks.items():
        place = CNames(program, local[name], SOLVED_PREFIX_ON_PAGE)
        for op in walk_ops(block):
            tests = [(test, test) for test in _inside(op)]
            if isinstance(op, Loop):
                yield DecisionSite(name, f"{place(op.index)} < {op.count}", (id(op),))
            if (
                isinstance(op, Loop)
                and (condition := split_loop_guard(op.index, op.body)[0]) is not None
            ):
                tests.append((negate_condition(condition), condition))
            if isinstance(op, Branch):
                tests.append((op.condition, op.condition))
            if isinstance(op, Count):
                tests.append((negate_condition(op.condition), op.condition))
            for shown, test in tests:
                numbers = tuple(id(condition) for condition in _conditions(test))
                yield DecisionSite(name, emit_expression(shown, place), numbers)
            if isinstance(op, Count):
                yield DecisionSite(name, f"{place(op.timer)} < {op.limit}U", (id(op),))


def prove_infeasible(
    program: Program, ranges: Mapping[str, Range], conditions: Collection[int]
) -> dict[int, bool]:
    """Return, by the number of a condition, the one outcome that it is proven never to have.

    `ranges` gives the ranges in which variables stay between two steps.
    """
    world = SymbolicProgram(program)
    facts = find_invariants(world, ranges)
    reach = Reachability(world, facts)
    found = {number: _outcome(world, facts, reach, number) for number in conditions}
    return {number: outcome for number, outcome in found.items() if outcome is not None}


def _outcome(
    world: SymbolicProgram, facts: Collection[Fact], reach: Reachability, number: int
) -> bool | None:
    """Return the outcome that a condition never has: what facts exclude is seen sooner."""
    visits = world.visits.get(number, [])
    for excluded in (partial(_is_excluded, world, facts), reach.never) if visits else ():
        for outcome in (True, False):
            if excluded(visits, outcome):
                return outcome
    return None


def _is_excluded(
    world: SymbolicProgram, facts: Collection[Fact], visits: Sequence[ConditionVisit], outcome: bool
) -> bool:
    """Tell whether facts alone exclude an outcome at all visits of a condition."""
    for visit in visits:
        term = visit.condition if outcome else world.z3.Not(visit.condition)
        known = known_at(world, visit.begin, facts)
        if not is_never(world, [term, *visit.given, *known]):
            return False
    return True


def _inside(op: Op) -> Iterator[Expr]:
    """Yield the decisions inside an operation: of choices, and of what is assigned as a truth."""
    for expr in direct_expressions(op):
        yield from (part.condition for part in walk_post_order(expr) if isinstance(part, Select))
    if (
        isinstance(op, Assign)
        and isinstance(op.value, Binary)
        and op.value.operator in LOGICAL_OPERATORS
    ):
        yield op.value


def _conditions(expr: Expr) -> Iterator[Expr]:
    """Yield the conditions of a decision: what stands between `and` and `or`."""
    match expr:
        case Binary("and" | "or", left, right):
            yield from _conditions(left)
            yield from _conditions(right)
        case Unary("not", Binary() as operand):
            yield from _conditions(operand)
        case _:
            yield expr
