"""Gate: inputs within their ranges are taken all at once in C, by few comparisons; bits stay.

A Program holds its inputs in their ranges one by one (rule 18). Nothing that it does with one reads
another, so where all of them are inside, which is nearly always, one branch takes them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from functools import reduce

from language.ir.number_type import MAX_FINITE
from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Compare,
    Expr,
    Ref,
    RunBlock,
    Unary,
    Value,
)
from language.ir.program import Program
from language.ir.rewrite_ops import map_expressions

LATCH = "latch"
WITHIN = "within"
"""A function of C alone."""
LATCH_EACH = "latch_each"
"""What takes the inputs one by one."""


def merge_range_checks(program: Program, by_magnitude: bool = True) -> Program:
    """Return a Program that takes its inputs at once where all are within their ranges (rule C17).

    `by_magnitude` compares the size of x with one end of a range, which takes one branch; tools that
    follow ranges through code know x better without it.
    """
    largest = MAX_FINITE[program.number_type]
    words = frozenset(variable.name for variable in program.variables if variable.values)

    def fewer(expr: Expr) -> Expr:
        plain = _finite_as_range(_drop_unsigned_bound(expr, words), largest)
        return fold_range_check(plain) if by_magnitude else plain

    blocks = {name: map_expressions(block, fewer) for name, block in program.blocks.items()}
    latch = blocks.get(LATCH, ())
    branches = [op for op in latch if isinstance(op, Branch) and _is_single_assignment(op.then)]
    if len(branches) == len(latch) > 1:
        inside = reduce(
            _conjunction, (part for branch in branches for part in _conjuncts(branch.condition))
        )
        assignments = tuple(op for branch in branches for op in branch.then)
        blocks = {
            LATCH_EACH: latch,
            **blocks,
            LATCH: (Branch(inside, assignments, (RunBlock(LATCH_EACH),)),),
        }
    return dataclasses.replace(program, blocks=blocks)


def fold_range_check(expr: Expr) -> Expr:
    """Return `low <= x <= high` as one comparison where 0 is between; with a NaN both are false.

    |x| <= high where the ends are equal, else `within`, which compares bits.
    """
    match expr:
        case Binary(
            "and", Compare(">=", value, Value(float(low))), Compare("<=", same, Value(float(high)))
        ) if value == same and low <= 0 <= high:
            if low == -high:
                return Compare("<=", Call("abs", (value,)), Value(high))
            return Call(WITHIN, (value, Value(low), Value(high)))
        case Unary("not", Binary() as inside):
            return Unary("not", fold_range_check(inside))
    return expr


def _finite_as_range(expr: Expr, largest: float) -> Expr:
    """Return `x - x >= 0`, true for what is finite, as a range that ends at the largest number."""
    match expr:
        case Compare(">=", Binary("-", value, same), Value(0.0)) if value == same:
            low, high = Value(-largest), Value(largest)
            return _conjunction(Compare(">=", value, low), Compare("<=", value, high))
    return expr


def _drop_unsigned_bound(expr: Expr, words: frozenset[str]) -> Expr:
    """Return the range of a word of an enumeration without `>= 0`: in C it is unsigned."""
    match expr:
        case Binary("and", Compare(">=", Ref(name), Value(0)), rest) if name in words:
            return rest
    return expr


def _conjuncts(condition: Expr) -> Iterator[Expr]:
    match condition:
        case Binary("and", left, right):
            yield from (*_conjuncts(left), *_conjuncts(right))
        case _:
            yield condition


def _conjunction(left: Expr, right: Expr) -> Expr:
    return Binary("and", left, right)


def _is_single_assignment(block: Block) -> bool:
    return len(block) == 1 and isinstance(block[0], Assign)
