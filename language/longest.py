"""Longest: a bound of the work of a step - operations on the way through its blocks that has most.

Each loop is taken to its end, of each branch the side with more; what cannot happen together is
counted together, so no step ever takes more.
"""

from __future__ import annotations

from collections.abc import Mapping

from language.operation import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Choose,
    Compare,
    Count,
    Expr,
    Item,
    Loop,
    Op,
    Run,
    Select,
    Store,
    Unary,
)

Blocks = Mapping[str, Block]


def most_operations(blocks: Blocks, name: str) -> int:
    """Return the most arithmetic, comparisons, calls, tests and stores of a block and its runs."""
    known: dict[str, int] = {}

    def of_block(name: str) -> int:
        if name not in known:
            known[name] = of(blocks[name])
        return known[name]

    def of(block: Block) -> int:
        return sum(map(of_op, block))

    def of_op(op: Op) -> int:
        match op:
            case Branch(condition, then, other):
                return 1 + of_expr(condition) + max(of(then), of(other))
            case Choose(_, cases):
                return 1 + max((of(case) for _, case in cases), default=0)
            case Loop(count, _, body):
                return count * (2 + of(body))
            case Run(inner):
                return of_block(inner)
            case Assign(_, value, _):
                return 1 + of_expr(value)
            case Store(_, index, value):
                return 1 + of_expr(index) + of_expr(value)
            case Count(_, condition, _, _):
                return 2 + of_expr(condition)
        return 1

    return of_block(name)


def of_expr(value: Expr) -> int:
    """Return the operations of an expression, both sides of a choice."""
    match value:
        case Unary(_, operand):
            return 1 + of_expr(operand)
        case Binary(_, left, right) | Compare(_, left, right):
            return 1 + of_expr(left) + of_expr(right)
        case Select(condition, then, other):
            return 1 + of_expr(condition) + max(of_expr(then), of_expr(other))
        case Call(_, arguments):
            return 1 + sum(map(of_expr, arguments))
        case Item(_, index, _):
            return 1 + of_expr(index)
    return 0
