"""Substitution: the expressions of a block replaced by others, whatever operation holds them."""

from __future__ import annotations

from collections.abc import Callable, Iterator

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
    Select,
    Store,
    Unary,
)

Change = Callable[[Expr], Expr]


def parts(expr: Expr) -> tuple[Expr, ...]:
    """Return the direct operands of an expression."""
    if isinstance(expr, (Binary, Compare)):
        return expr.left, expr.right
    if isinstance(expr, Call):
        return expr.arguments
    if isinstance(expr, Unary):
        return (expr.operand,)
    if isinstance(expr, Select):
        return expr.condition, expr.then, expr.other
    return (expr.index,) if isinstance(expr, Item) else ()


def with_parts(expr: Expr, change: Change) -> Expr:
    """Return an expression with its direct operands changed: itself where none is another one."""
    if isinstance(expr, (Binary, Compare)):
        left, right = change(expr.left), change(expr.right)
        is_same = left is expr.left and right is expr.right
        return expr if is_same else type(expr)(expr.operator, left, right)  # type: ignore[arg-type]
    if isinstance(expr, Call):
        arguments = tuple(change(argument) for argument in expr.arguments)
        is_same = all(new is old for new, old in zip(arguments, expr.arguments, strict=True))
        return expr if is_same else Call(expr.function, arguments)
    if isinstance(expr, Unary):
        operand = change(expr.operand)
        return expr if operand is expr.operand else Unary(expr.operator, operand)
    if isinstance(expr, Select):
        condition, then, other = change(expr.condition), change(expr.then), change(expr.other)
        old = expr.condition, expr.then, expr.other
        is_same = condition is old[0] and then is old[1] and other is old[2]
        return expr if is_same else Select(condition, then, other)
    if isinstance(expr, Item):
        index = change(expr.index)
        return expr if index is expr.index else Item(expr.name, index, expr.whole)
    return expr


def with_expressions(block: Block, change: Change) -> Block:
    """Return a block with every expression that an operation reads changed."""
    return tuple(_op(op, change) for op in block)


def own_expressions(op: Op) -> tuple[Expr, ...]:
    """Return the expressions that an operation reads itself, not those of blocks inside it."""
    match op:
        case Assign(_, value, _):
            return (value,)
        case Store(_, index, value):
            return index, value
        case Branch(condition, _, _) | Count(_, condition, _, _):
            return (condition,)
        case _:
            return ()


def subexpressions(expr: Expr) -> Iterator[Expr]:
    """Yield an expression and all inside it, the innermost first."""
    for part in parts(expr):
        yield from subexpressions(part)
    yield expr


def _op(op: Op, change: Change) -> Op:
    match op:
        case Assign(target, value, key):
            return Assign(target, change(value), key)
        case Store(array, index, value):
            return Store(array, change(index), change(value))
        case Branch(condition, then, other):
            inner = (with_expressions(block, change) for block in (then, other))
            return Branch(change(condition), *inner)
        case Choose(selector, cases):
            return Choose(selector, tuple((k, with_expressions(b, change)) for k, b in cases))
        case Loop(count, index, body):
            return Loop(count, index, with_expressions(body, change))
        case Count(timer, condition, limit, key):
            return Count(timer, change(condition), limit, key)
        case _:
            return op
