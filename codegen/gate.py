"""Gate: inputs within their ranges are taken all at once in C, by few comparisons; bits stay.

A Program holds its inputs in their ranges one by one (rule 18). Nothing that it does with one reads
another, so where all of them are inside, which is nearly always, one branch takes them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from functools import reduce

from language.number import LARGEST
from language.operation import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Compare,
    Expr,
    Ref,
    Run,
    Unary,
    Value,
)
from language.program import Program
from language.substitution import with_expressions

LATCH = "latch"
WITHIN = "within"
"""A function of C alone."""
LATCH_EACH = "latch_each"
"""What takes the inputs one by one."""


def gated(program: Program, by_amount: bool = True) -> Program:
    """Return a Program that takes its inputs at once where all are within their ranges (rule C17).

    `by_amount` compares the size of x with one end of a range, which takes one branch; tools that
    follow ranges through code know x better without it.
    """
    largest = LARGEST[program.number]
    words = frozenset(variable.name for variable in program.variables if variable.values)

    def fewer(expr: Expr) -> Expr:
        plain = _finite(_unsigned(expr, words), largest)
        return centred(plain) if by_amount else plain

    blocks = {name: with_expressions(block, fewer) for name, block in program.blocks.items()}
    taken = blocks.get(LATCH, ())
    held = [op for op in taken if isinstance(op, Branch) and _takes(op.then)]
    if len(held) == len(taken) > 1:
        inside = reduce(_both, (part for branch in held for part in _parts(branch.condition)))
        together = tuple(op for branch in held for op in branch.then)
        blocks = {
            LATCH_EACH: taken,
            **blocks,
            LATCH: (Branch(inside, together, (Run(LATCH_EACH),)),),
        }
    return dataclasses.replace(program, blocks=blocks)


def centred(expr: Expr) -> Expr:
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
            return Unary("not", centred(inside))
    return expr


def _finite(expr: Expr, largest: float) -> Expr:
    """Return `x - x >= 0`, true for what is finite, as a range that ends at the largest number."""
    match expr:
        case Compare(">=", Binary("-", value, same), Value(0.0)) if value == same:
            low, high = Value(-largest), Value(largest)
            return _both(Compare(">=", value, low), Compare("<=", value, high))
    return expr


def _unsigned(expr: Expr, words: frozenset[str]) -> Expr:
    """Return the range of a word of an enumeration without `>= 0`: in C it is unsigned."""
    match expr:
        case Binary("and", Compare(">=", Ref(name), Value(0)), rest) if name in words:
            return rest
    return expr


def _parts(condition: Expr) -> Iterator[Expr]:
    match condition:
        case Binary("and", left, right):
            yield from (*_parts(left), *_parts(right))
        case _:
            yield condition


def _both(left: Expr, right: Expr) -> Expr:
    return Binary("and", left, right)


def _takes(block: Block) -> bool:
    return len(block) == 1 and isinstance(block[0], Assign)
