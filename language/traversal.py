"""Traversal: every operation of a block, and the names that blocks read and write."""

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
        match op:
            case Branch(_, then, other):
                stack += reversed(other)
                stack += reversed(then)
            case Choose(_, cases):
                for _, case_block in reversed(cases):
                    stack += reversed(case_block)
            case Loop(_, _, body):
                stack += reversed(body)


def block_names(block: Block) -> Iterator[str]:
    """Yield the variables and constants that a block reads or writes, and `call <function>`."""
    yield from block_reads(block)
    yield from block_writes(block)


def block_reads(block: Block) -> Iterator[str]:
    """Yield the variables that a block reads."""
    for op in walk(block):
        match op:
            case Assign(_, value, _):
                yield from expr_names(value)
            case Store(_, index, value):
                yield from expr_names(index)
                yield from expr_names(value)
            case Branch(condition, _, _) | Count(_, condition, _, _):
                yield from expr_names(condition)
            case Choose(selector, _):
                yield selector
            case _:
                pass


def block_writes(block: Block) -> Iterator[str]:
    """Yield the variables that a block writes."""
    for op in walk(block):
        match op:
            case Assign(target, _, _):
                yield target
            case Store(array, _, _):
                yield array
            case Count(timer, _, _, _):
                yield timer
            case Loop(_, index, _):
                yield index
            case FaultBit():
                yield "memory.faults"
            case _:
                pass


def expr_names(expr: Expr) -> Iterator[str]:
    """Yield the variables and constants that an expression reads, and `call <function>`."""
    for part in parts(expr):
        if isinstance(part, Ref | Item):
            yield part.name
        elif isinstance(part, Call):
            yield f"call {part.function}"


def parts(expr: Expr) -> Sequence[Expr]:
    """Return every part of an expression, parents first."""
    if isinstance(expr, Ref | Value):
        return (expr,)
    stack: list[Expr] = [expr]
    found: list[Expr] = []
    while stack:
        part = stack.pop()
        found.append(part)
        if isinstance(part, Ref | Value):
            continue
        if isinstance(part, Binary | Compare):
            stack += (part.right, part.left)
        elif isinstance(part, Call):
            stack += part.arguments[::-1]
        elif isinstance(part, Unary):
            stack.append(part.operand)
        elif isinstance(part, Select):
            stack += (part.other, part.then, part.condition)
        else:
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
