"""Traversal: the operations of a block, and the names that blocks and expressions read and write.

The functions are called often by all passes; they use explicit stacks instead of recursion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Compare,
    Count,
    Expr,
    FaultBit,
    Item,
    Loop,
    Op,
    Ref,
    RunBlock,
    Select,
    Store,
    Switch,
    Unary,
)
from language.ir.rewrite_ops import direct_expressions


def walk_ops(block: Block) -> Iterator[Op]:
    """Yield every operation of a block in the order of the text, inner blocks included.

    An operation comes before the operations of its inner blocks. Blocks of RunBlock are not
    entered.
    """
    stack = list(reversed(block))
    while stack:
        op = stack.pop()
        yield op
        if isinstance(op, Branch):
            stack += op.other[::-1]
            stack += op.then[::-1]
        elif isinstance(op, Switch):
            for _, case_block in reversed(op.cases):
                stack += case_block[::-1]
        elif isinstance(op, Loop):
            stack += op.body[::-1]


def block_reads(block: Block) -> list[str]:
    """Return the variables and constants that a block reads, in the order of the text, repeated.

    Inner blocks and selectors of switches are included, blocks of RunBlock are not. A counter is
    not among the reads of its own operation.
    """
    names: list[str] = []
    for op in walk_ops(block):
        if isinstance(op, Switch):
            names.append(op.selector)
        for expr in direct_expressions(op):
            names += expr_names(expr)
    return names


def block_writes(block: Block) -> list[str]:
    """Return the variables that a block writes, in the order of the text, with repetitions.

    They are targets, arrays, counters and the indices of loops; a fault bit writes `memory.faults`.
    Inner blocks are included, blocks of RunBlock are not.
    """
    names: list[str] = []
    for op in walk_ops(block):
        if isinstance(op, Assign):
            names.append(op.target)
        elif isinstance(op, Store):
            names.append(op.array)
        elif isinstance(op, Count):
            names.append(op.timer)
        elif isinstance(op, Loop):
            names.append(op.index)
        elif isinstance(op, FaultBit):
            names.append("memory.faults")
    return names


def expr_names(expr: Expr) -> list[str]:
    """Return the variables and constants that an expression reads, with repetitions.

    The names are in the order of `subexpressions` (parents first); an array element gives the name
    of its array.
    """
    return [part.name for part in subexpressions(expr) if isinstance(part, (Ref, Item))]


def expr_functions(expr: Expr) -> list[str]:
    """Return the functions that an expression calls, in the order of `subexpressions`, repeated."""
    return [part.function for part in subexpressions(expr) if isinstance(part, Call)]


def subexpressions(expr: Expr) -> Sequence[Expr]:
    """Return every part of an expression, parents first, operands from left to right.

    The expression itself is the first part.
    """
    stack: list[Expr] = [expr]
    result: list[Expr] = []
    while stack:
        part = stack.pop()
        result.append(part)
        if isinstance(part, (Binary, Compare)):
            stack += (part.right, part.left)
        elif isinstance(part, Call):
            stack += part.arguments[::-1]
        elif isinstance(part, Unary):
            stack.append(part.operand)
        elif isinstance(part, Select):
            stack += (part.other, part.then, part.condition)
        elif isinstance(part, Item):
            stack.append(part.index)
    return result


def names_used(blocks: Iterable[Block]) -> set[str]:
    """Return the variables and constants that some blocks read or write.

    They are those of `block_reads` and `block_writes`; blocks of RunBlock are not entered.
    """
    return {name for block in blocks for name in (*block_reads(block), *block_writes(block))}


def called_functions(blocks: Iterable[Block]) -> set[str]:
    """Return the functions that some blocks call; blocks of RunBlock are not entered."""
    ops = (op for block in blocks for op in walk_ops(block))
    return {name for op in ops for expr in direct_expressions(op) for name in expr_functions(expr)}


def called_blocks(block: Block) -> list[str]:
    """Return the names of the blocks that a block runs directly, in its order, with repetitions."""
    return [op.block for op in walk_ops(block) if isinstance(op, RunBlock)]


def reachable_blocks(name: str, blocks: Mapping[str, Block]) -> set[str]:
    """Return the name of a block and the names of all blocks that it runs, even indirectly.

    Raises KeyError for a block that is not in `blocks`.
    """
    return reachable_names(name, lambda one: called_blocks(blocks[one]))


def reachable_names(name: str, next_of: Callable[[str], Iterable[str]]) -> set[str]:
    """Return a name and all that follow from it; `next_of` gives those that follow directly."""
    result, stack = set[str](), [name]
    while stack:
        one = stack.pop()
        if one not in result:
            result.add(one)
            stack += next_of(one)
    return result


def negate_condition(condition: Expr) -> Expr:
    """Return the negation of a condition: `not a -> a`, `a == b -> a != b`, else `not condition`.

    An order relation is not reversed, because it is false for a NaN.
    """
    match condition:
        case Unary("not", operand):
            return operand
        case Compare("==", left, right):
            return Compare("!=", left, right)
        case Compare("!=", left, right):
            return Compare("==", left, right)
    return Unary("not", condition)
