"""Substitution: the expressions of a block replaced by others, whatever operation holds them."""

from __future__ import annotations

import dataclasses
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
    match expr:
        case Item(_, index):
            return (index,)
        case Unary(_, operand):
            return (operand,)
        case Binary(_, left, right) | Compare(_, left, right):
            return left, right
        case Select(condition, then, other):
            return condition, then, other
        case Call(_, arguments):
            return arguments
        case _:
            return ()


def with_parts(expr: Expr, change: Change) -> Expr:
    """Return an expression with its direct operands changed."""
    match expr:
        case Item(name, index, whole):
            return Item(name, change(index), whole)
        case Unary(operator, operand):
            return Unary(operator, change(operand))
        case Binary(operator, left, right):
            return Binary(operator, change(left), change(right))
        case Compare(operator, left, right):
            return Compare(operator, change(left), change(right))
        case Select(condition, then, other):
            return Select(change(condition), change(then), change(other))
        case Call(function, arguments):
            return Call(function, tuple(change(argument) for argument in arguments))
        case _:
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
        case Assign(_, value, _):
            return dataclasses.replace(op, value=change(value))
        case Store(_, index, value):
            return dataclasses.replace(op, index=change(index), value=change(value))
        case Branch(condition, then, other):
            inner = (with_expressions(block, change) for block in (then, other))
            return Branch(change(condition), *inner)
        case Choose(selector, cases):
            return Choose(selector, tuple((k, with_expressions(b, change)) for k, b in cases))
        case Loop(count, index, body):
            return Loop(count, index, with_expressions(body, change))
        case Count(_, condition, _, _):
            return dataclasses.replace(op, condition=change(condition))
        case _:
            return op
