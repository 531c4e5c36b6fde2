"""Dense output: the polynomial through a step, and the evaluation of guards on it.

Only states that the guards read are evaluated. If each guard is a conjunction with a part that
reads states only, these parts are tested first; while all of them are false, the remaining states
and the guards are not evaluated.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce

from language.integration.vector_field import VectorField
from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Expr,
    Item,
    Loop,
    Op,
    Ref,
    RunBlock,
    Value,
    add,
    integer,
    multiply,
    real,
    subtract,
)
from language.ir.traversal import expr_functions, expr_names, names_used, reachable_blocks
from language.model.automaton import Mode

MAX_UNROLLED_TERMS = 8
"""The largest number of terms of a polynomial without a loop."""
CONSTANT_PREFIXES = ("constant.", "calibration.", "derived.")
GUARD_PREFIX, POINT_PREFIX = "work.guard_", "work.at_"


@dataclass(frozen=True)
class DenseOutput:
    """The polynomials of a step, with their number of terms; constant states have none."""

    terms: int
    constant_states: frozenset[str]

    def evaluate(self, states: Sequence[str]) -> Block:
        """Return the operations that set `work.at_<state>` of some states at `work.s`.

        Constant states come first and get their present value; the others get that of their
        polynomial.
        """
        still = [name for name in states if name in self.constant_states]
        ops = [Assign(f"work.at_{name}", Ref(f"state.{name}")) for name in still]
        return (
            *ops,
            *_evaluate_polynomials(
                [n for n in states if n not in self.constant_states], self.terms
            ),
        )


def _evaluate_polynomials(states: Sequence[str], terms: int) -> Block:
    """Return x(s) = x0 + s (d0 + s (d1 + ...)) at `work.s` by Horner's rule, for each state."""
    s = Ref("work.s")
    if terms <= MAX_UNROLLED_TERMS:
        return tuple(_unroll_horner(name, terms) for name in states)
    first: list[Op] = [Assign(f"work.sum_{name}", real(0.0)) for name in states]
    index = subtract(integer(terms - 1), Ref("work.term"))
    body: list[Op] = []
    last: list[Op] = []
    for name in states:
        total = Ref(f"work.sum_{name}")
        value = add(multiply(total, s), Item(f"work.series_{name}", index))
        body.append(Assign(f"work.sum_{name}", value))
        last.append(Assign(f"work.at_{name}", add(Ref(f"state.{name}"), multiply(s, total))))
    return (*first, Loop(terms, "work.term", tuple(body)), *last)


def _unroll_horner(name: str, terms: int) -> Assign:
    """Return Horner's rule for one state as a single assignment."""
    s, series = Ref("work.s"), f"work.series_{name}"
    total: Expr = Item(series, integer(terms - 1))
    for term in reversed(range(terms - 1)):
        total = add(multiply(total, s), Item(series, integer(term)))
    return Assign(f"work.at_{name}", add(Ref(f"state.{name}"), multiply(s, total)))


def event_search_block(
    field: VectorField, mode: Mode, dense_output: DenseOutput, flows: Mapping[str, Block]
) -> Block:
    """Return the block that evaluates the guards of a mode at `work.s`.

        point; guards    ->    states of the condition; if condition: other states; guards
                               else: guards = false

    The condition reads states and constants only, and is true whenever a guard is: it has one part
    of each guard, that with the fewest states. The first form is used without such a condition, or
    if it reads all states that the guards read. `flows` are the blocks of the field. States that
    neither the guards nor their equations read are not evaluated.
    """
    guards = f"guards_{mode.name}"
    read = _names_used(guards, flows)
    needed = [name for name in field.states if f"{POINT_PREFIX}{name}" in read]
    gate = _necessary_condition(field, flows[guards])
    if gate is not None:
        first = [name for name in needed if f"{POINT_PREFIX}{name}" in set(expr_names(gate))]
        rest = [name for name in needed if name not in first]
        if rest:
            closed = [Assign(op.target, Value(False)) for op in _guard_assignments(flows[guards])]
            opened: Block = (*dense_output.evaluate(rest), RunBlock(guards))
            return (*dense_output.evaluate(first), Branch(gate, opened, tuple(closed)))
    is_all = len(needed) == len(field.states)
    point: Block = (RunBlock("point"),) if is_all else dense_output.evaluate(needed)
    return (*point, RunBlock(guards))


def _names_used(name: str, flows: Mapping[str, Block]) -> set[str]:
    """Return all names that a block reads or writes, including the blocks that it runs."""
    return names_used(flows[run] for run in reachable_blocks(name, flows))


def _guard_assignments(block: Block) -> Iterator[Assign]:
    """Yield the assignments of guards of a block."""
    return (op for op in block if isinstance(op, Assign) and op.target.startswith(GUARD_PREFIX))


def _necessary_condition(field: VectorField, block: Block) -> Expr | None:
    """Return a condition on states alone that is true whenever a guard of the block is true.

    It is the disjunction of one part of each guard, that with the fewest states. The result is None
    if a guard has no such part or the block has operations other than assignments of equations and
    guards.
    """
    states = {f"{POINT_PREFIX}{name}" for name in field.states}
    if not all(
        isinstance(op, Assign) and op.target.startswith((GUARD_PREFIX, POINT_PREFIX))
        for op in block
    ):
        return None
    gates = []
    for guard in _guard_assignments(block):
        parts = [part for part in _conjuncts(guard.value) if _reads_only(part, states)]
        if not parts:
            return None
        gates.append(min(parts, key=lambda part: len(set(expr_names(part)) & states)))
    return reduce(lambda one, other: Binary("or", one, other), gates) if gates else None


def _conjuncts(guard: Expr) -> list[Expr]:
    """Return the parts of a conjunction, from left to right."""
    match guard:
        case Binary("and", left, right):
            return [*_conjuncts(left), *_conjuncts(right)]
    return [guard]


def _reads_only(part: Expr, states: set[str]) -> bool:
    """Return whether an expression without calls reads states, and else constants only."""
    names = set(expr_names(part))
    is_arithmetic = not expr_functions(part)
    return (
        is_arithmetic
        and bool(names & states)
        and all(n in states or n.startswith(CONSTANT_PREFIXES) for n in names)
    )
