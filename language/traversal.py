"""Traversal: every operation of a block, and the names that blocks read and write.

Every pass asks for these again and again: a kind of operation is asked for after the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

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
    FaultBit,
    Item,
    Loop,
    Op,
    Ref,
    Run,
    Select,
    Store,
    Unary,
    Value,
)


def walk(block: Block) -> Iterator[Op]:
    """Yield every operation of a block, those inside others too."""
    stack = list(reversed(block))
    while stack:
        op = stack.pop()
        yield op
        if isinstance(op, Branch):
            stack += op.other[::-1]
            stack += op.then[::-1]
        elif isinstance(op, Choose):
            for _, case_block in reversed(op.cases):
                stack += case_block[::-1]
        elif isinstance(op, Loop):
            stack += op.body[::-1]


def block_names(block: Block) -> list[str]:
    """Return the variables and constants that a block reads or writes, and `call <function>`."""
    return block_reads(block) + block_writes(block)


def block_reads(block: Block) -> list[str]:
    """Return the variables that a block reads."""
    found: list[str] = []
    for op in walk(block):
        if isinstance(op, Assign):
            found += expr_names(op.value)
        elif isinstance(op, (Branch, Count)):
            found += expr_names(op.condition)
        elif isinstance(op, Store):
            found += expr_names(op.index)
            found += expr_names(op.value)
        elif isinstance(op, Choose):
            found.append(op.selector)
    return found


def block_writes(block: Block) -> list[str]:
    """Return the variables that a block writes."""
    found: list[str] = []
    for op in walk(block):
        if isinstance(op, Assign):
            found.append(op.target)
        elif isinstance(op, Store):
            found.append(op.array)
        elif isinstance(op, Count):
            found.append(op.timer)
        elif isinstance(op, Loop):
            found.append(op.index)
        elif isinstance(op, FaultBit):
            found.append("memory.faults")
    return found


def expr_names(expr: Expr) -> list[str]:
    """Return the variables and constants that an expression reads, and `call <function>`."""
    found: list[str] = []
    for part in parts(expr):
        if isinstance(part, (Ref, Item)):
            found.append(part.name)
        elif isinstance(part, Call):
            found.append(f"call {part.function}")
    return found


def parts(expr: Expr) -> Sequence[Expr]:
    """Return every part of an expression, parents first."""
    stack: list[Expr] = [expr]
    found: list[Expr] = []
    while stack:
        part = stack.pop()
        found.append(part)
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
    return found


def reads(blocks: Iterable[Block]) -> set[str]:
    """Return every name that some blocks read or write."""
    return {name for block in blocks for name in block_names(block)}


def reached(name: str, blocks: Mapping[str, Block]) -> set[str]:
    """Return a block's name and those of all that it runs."""
    found, stack = set[str](), [name]
    while stack:
        one = stack.pop()
        if one not in found:
            found.add(one)
            stack += [op.block for op in walk(blocks[one]) if isinstance(op, Run)]
    return found


def with_value(block: Block, name: str, number: int) -> Block:
    """Return assignments and stores in which a whole-number variable has a value."""
    found: list[Op] = []
    for op in block:
        match op:
            case Assign(target, value, key):
                found.append(Assign(target, _with_value(value, name, number), key))
            case Store(array, index, value):
                parts = (_with_value(part, name, number) for part in (index, value))
                found.append(Store(array, *parts))
            case _:
                raise TypeError(f"neither an assignment nor a store: {op!r}")
    return tuple(found)


def _with_value(expr: Expr, name: str, number: int) -> Expr:
    def part(inner: Expr) -> Expr:
        return _with_value(inner, name, number)

    match expr:
        case Ref(variable):
            return Value(number) if variable == name else expr
        case Item(array, index, is_whole):
            return Item(array, part(index), is_whole)
        case Unary(operator, operand):
            return Unary(operator, part(operand))
        case Binary(operator, left, right):
            return Binary(operator, part(left), part(right))
        case Compare(operator, left, right):
            return Compare(operator, part(left), part(right))
        case Select(condition, then, other):
            return Select(part(condition), part(then), part(other))
        case Call(function, arguments):
            return Call(function, tuple(part(argument) for argument in arguments))
        case Value():
            return expr
