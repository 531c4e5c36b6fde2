"""Operation count: an upper bound of the number of operations that one call of a block executes.

A loop counts with its full number of passes and a branch with its longer side. No execution exceeds
the bound.
"""

from __future__ import annotations

from collections.abc import Mapping

from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Compare,
    Count,
    Expr,
    Item,
    Loop,
    Op,
    RunBlock,
    Select,
    Store,
    Switch,
    Unary,
)

Blocks = Mapping[str, Block]


def max_operations(blocks: Blocks, name: str) -> int:
    """Return the largest number of operations that one run of the block `name` executes.

    Operators, comparisons, choices, array elements, calls, tests, assignments and stores count as
    one each, a counter and each pass of a loop as two more than their parts. Blocks that it runs
    are included, the bodies of called functions are not. Of a branch or switch the longest side
    counts. Raises KeyError for an unknown block.
    """
    counts: dict[str, int] = {}

    def count_block(name: str) -> int:
        if name not in counts:
            counts[name] = count_ops(blocks[name])
        return counts[name]

    def count_ops(block: Block) -> int:
        return sum(map(count_op, block))

    def count_op(op: Op) -> int:
        match op:
            case Branch(condition, then, other):
                return 1 + count_expr(condition) + max(count_ops(then), count_ops(other))
            case Switch(_, cases):
                return 1 + max((count_ops(case) for _, case in cases), default=0)
            case Loop(count, _, body):
                return count * (2 + count_ops(body))
            case RunBlock(inner):
                return count_block(inner)
            case Assign(_, value, _):
                return 1 + count_expr(value)
            case Store(_, index, value):
                return 1 + count_expr(index) + count_expr(value)
            case Count(_, condition, _, _):
                return 2 + count_expr(condition)
        return 1

    return count_block(name)


def count_expr(value: Expr) -> int:
    """Return the number of operators, comparisons, choices, calls and elements of an expression.

    Literals and variables count as none. Only the longer alternative of a choice counts, and the
    bodies of called functions do not.
    """
    match value:
        case Unary(_, operand):
            return 1 + count_expr(operand)
        case Binary(_, left, right) | Compare(_, left, right):
            return 1 + count_expr(left) + count_expr(right)
        case Select(condition, then, other):
            return 1 + count_expr(condition) + max(count_expr(then), count_expr(other))
        case Call(_, arguments):
            return 1 + sum(map(count_expr, arguments))
        case Item(_, index, _):
            return 1 + count_expr(index)
    return 0
