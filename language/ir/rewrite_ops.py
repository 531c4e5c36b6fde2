"""Rewriting: replacement of the expressions in the operations of a block.

target := e  ->  target := transform(e)        (likewise in every kind of operation)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

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
    Select,
    Store,
    Switch,
    Unary,
)

ExprTransform = Callable[[Expr], Expr]


def operands(expr: Expr) -> tuple[Expr, ...]:
    """Return the direct operands of an expression from left to right; Value and Ref have none.

    A choice gives condition, then, other; an array element gives its index.
    """
    if isinstance(expr, (Binary, Compare)):
        return expr.left, expr.right
    if isinstance(expr, Call):
        return expr.arguments
    if isinstance(expr, Unary):
        return (expr.operand,)
    if isinstance(expr, Select):
        return expr.condition, expr.then, expr.other
    return (expr.index,) if isinstance(expr, Item) else ()


def map_operands(expr: Expr, transform: ExprTransform) -> Expr:
    """Return an expression with `transform` applied to its direct operands, from left to right.

    The same object is returned if `transform` returns every operand unchanged (by identity), and
    for an expression without operands.
    """
    if isinstance(expr, (Binary, Compare)):
        left, right = transform(expr.left), transform(expr.right)
        is_same = left is expr.left and right is expr.right
        return expr if is_same else type(expr)(expr.operator, left, right)  # type: ignore[arg-type]
    if isinstance(expr, Call):
        arguments = tuple(transform(argument) for argument in expr.arguments)
        is_same = all(new is old for new, old in zip(arguments, expr.arguments, strict=True))
        return expr if is_same else Call(expr.function, arguments)
    if isinstance(expr, Unary):
        operand = transform(expr.operand)
        return expr if operand is expr.operand else Unary(expr.operator, operand)
    if isinstance(expr, Select):
        condition, then, other = (
            transform(expr.condition),
            transform(expr.then),
            transform(expr.other),
        )
        old = expr.condition, expr.then, expr.other
        is_same = condition is old[0] and then is old[1] and other is old[2]
        return expr if is_same else Select(condition, then, other)
    if isinstance(expr, Item):
        index = transform(expr.index)
        return expr if index is expr.index else Item(expr.name, index, expr.is_integer)
    return expr


def map_expressions(block: Block, transform: ExprTransform) -> Block:
    """Return a block with `transform` applied to each expression that an operation of it reads.

    These are the values of assignments, the indices and values of stores and the conditions of
    branches and counters, inner blocks included, but not the selector of a switch. `transform` gets
    whole expressions, not their parts.
    """
    return tuple(_map_op(op, transform) for op in block)


def remove_empty_switches(block: Block) -> Block:
    """Return a block without switches that have no cases, also inside other operations.

    when x is <nothing>    ->    <no operation>
    """
    ops: list[Op] = []
    for op in block:
        match op:
            case Switch(_, ()):
                pass
            case Switch(selector, cases):
                inner = tuple((number, remove_empty_switches(case)) for number, case in cases)
                ops.append(Switch(selector, inner))
            case Branch(condition, then, other):
                arms = remove_empty_switches(then), remove_empty_switches(other)
                ops.append(Branch(condition, *arms))
            case Loop(count, index, body):
                ops.append(Loop(count, index, remove_empty_switches(body)))
            case _:
                ops.append(op)
    return tuple(ops)


def direct_expressions(op: Op) -> tuple[Expr, ...]:
    """Return the expressions that an operation reads itself, without those of its inner blocks.

    They are the value of an assignment, index and value of a store, or the condition of a branch or
    counter; other operations have none.
    """
    match op:
        case Assign(_, value, _):
            return (value,)
        case Store(_, index, value):
            return index, value
        case Branch(condition, _, _) | Count(_, condition, _, _):
            return (condition,)
        case _:
            return ()


def walk_post_order(expr: Expr) -> Iterator[Expr]:
    """Yield all parts of an expression, operands before the expression that contains them.

    Operands come from left to right, and `expr` itself comes last.
    """
    for part in operands(expr):
        yield from walk_post_order(part)
    yield expr


def _map_op(op: Op, transform: ExprTransform) -> Op:
    """Return an operation with `transform` applied to its expressions, inner blocks included."""
    match op:
        case Assign(target, value, key):
            return Assign(target, transform(value), key)
        case Store(array, index, value):
            return Store(array, transform(index), transform(value))
        case Branch(condition, then, other):
            inner = (map_expressions(block, transform) for block in (then, other))
            return Branch(transform(condition), *inner)
        case Switch(selector, cases):
            return Switch(selector, tuple((k, map_expressions(b, transform)) for k, b in cases))
        case Loop(count, index, body):
            return Loop(count, index, map_expressions(body, transform))
        case Count(timer, condition, limit, key):
            return Count(timer, transform(condition), limit, key)
        case _:
            return op
