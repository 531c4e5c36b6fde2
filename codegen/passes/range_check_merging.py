"""Range check merging: a pass that checks all inputs of a step with one condition (rule C17).

  before                                            after
  block latch                                       block latch
      if ((input.a >= 0.0) and (input.a <= 5.0))        if (within(input.a, 0.0, 5.0) and
          latched.a := input.a                                  (abs(input.b) <= 1.0))
      else                                                  latched.a := input.a
          fault range_a of a                                latched.b := input.b
          latched.a := clip(input.a, 0.0, 5.0)          else
      if ((input.b >= -1.0) and (input.b <= 1.0))           run latch_each
          latched.b := input.b                      block latch_each
      else                                              <the block latch of before>
          ...

A Program saturates its inputs one by one (rule 18), and these operations are independent of each
other. In nearly all steps every input is within its range, so one branch takes them all. The bits
of all results stay the same.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from functools import reduce

from language.ir.number_type import MAX_FINITE
from language.ir.ops import (
    Assign,
    Binary,
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
"""The block that takes the inputs of a step."""
WITHIN = "within"
"""The function `low <= x <= high`, which exists in C only."""
LATCH_EACH = "latch_each"
"""The block that takes the inputs one by one."""


def merge_range_checks(program: Program, by_magnitude: bool = True) -> Program:
    """Return a Program that takes all inputs at once if all are within their ranges (rule C17).

    The block `latch` is merged if it has at least two operations, all of them branches whose then
    part is one assignment; its old form becomes the block `latch_each`. In all blocks, `x - x >= 0`
    becomes a range check and an enumeration loses its check `>= 0`. With `by_magnitude` a range
    check also becomes one comparison (`fold_range_check`); without it the bounds stay visible to
    tools that propagate ranges through code.
    """
    largest = MAX_FINITE[program.number_type]
    words = frozenset(variable.name for variable in program.variables if variable.values)

    def fewer(expr: Expr) -> Expr:
        plain = _finite_as_range(_drop_unsigned_bound(expr, words), largest)
        return fold_range_check(plain) if by_magnitude else plain

    blocks = {name: map_expressions(block, fewer) for name, block in program.blocks.items()}
    latch = blocks.get(LATCH, ())
    branches = [
        op
        for op in latch
        if isinstance(op, Branch) and len(op.then) == 1 and isinstance(op.then[0], Assign)
    ]
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
    """Return `low <= x <= high` as one comparison if 0 is between the ends; also below `not`.

    It becomes |x| <= high if low is -high, else a call of `within`, which compares bits. Both are
    false for a NaN, as before. Any other expression is returned unchanged; operands are not
    searched.
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
    """Return `x - x >= 0`, the test for a finite number, as `-largest <= x and x <= largest`."""
    match expr:
        case Compare(">=", Binary("-", value, same), Value(0.0)) if value == same:
            low, high = Value(-largest), Value(largest)
            return _conjunction(Compare(">=", value, low), Compare("<=", value, high))
    return expr


def _drop_unsigned_bound(expr: Expr, words: frozenset[str]) -> Expr:
    """Return the range check of an enumeration without `>= 0`, because it is unsigned in C.

    `words` holds the names of variables with enumeration values.
    """
    match expr:
        case Binary("and", Compare(">=", Ref(name), Value(0)), rest) if name in words:
            return rest
    return expr


def _conjuncts(condition: Expr) -> Iterator[Expr]:
    """Yield the operands of nested `and` from left to right."""
    match condition:
        case Binary("and", left, right):
            yield from (*_conjuncts(left), *_conjuncts(right))
        case _:
            yield condition


def _conjunction(left: Expr, right: Expr) -> Expr:
    """Return the expression `left and right`."""
    return Binary("and", left, right)
