"""Rewriting: replacement of the expressions in the operations of a block.

target := e  ->  target := transform(e)        (likewise in every kind of operation)
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

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
    Ref,
    Select,
    Store,
    Switch,
    Unary,
    Value,
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
    return map_operations(block, lambda op: (_map_direct_expressions(op, transform),))


def map_operations(block: Block, change: Callable[[Op], Iterable[Op]]) -> Block:
    """Return a block with each operation replaced by those that `change` gives for it.

    Inner blocks come first: `change` gets an operation whose inner blocks are replaced already.
    """

    def changed(inner: Block) -> Block:
        """Return an inner block with its operations replaced."""
        return map_operations(inner, change)

    found: list[Op] = []
    for op in block:
        found += change(map_inner_blocks(op, changed))
    return tuple(found)


def map_inner_blocks(op: Op, change: Callable[[Block], Block]) -> Op:
    """Return an operation with `change` applied to each block inside it, in the order of the text.

    An operation without inner blocks is returned as it is.
    """
    match op:
        case Branch(condition, then, other):
            return Branch(condition, change(then), change(other))
        case Switch(selector, cases):
            return Switch(selector, tuple((number, change(case)) for number, case in cases))
        case Loop(count, index, body):
            return Loop(count, index, change(body))
    return op


def substitute_variable(block: Block, name: str, constant: int) -> Block:
    """Return a block with a literal in place of each read of a whole-number variable.

    Targets, arrays and selectors keep their names.
    """

    def substituted(expr: Expr) -> Expr:
        """Return an expression with the literal."""
        is_read = isinstance(expr, Ref) and expr.name == name
        return Value(constant) if is_read else map_operands(expr, substituted)

    return map_expressions(block, substituted)


def remove_empty_switches(block: Block) -> Block:
    """Return a block without switches that have no cases, also inside other operations.

    when x is <nothing>    ->    <no operation>
    """

    def keep(op: Op) -> Block:
        """Return an operation, nothing for a switch without cases."""
        return () if isinstance(op, Switch) and not op.cases else (op,)

    return map_operations(block, keep)


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


def _map_direct_expressions(op: Op, transform: ExprTransform) -> Op:
    """Return an operation with `transform` applied to its `direct_expressions`."""
    match op:
        case Assign(target, value, key):
            return Assign(target, transform(value), key)
        case Store(array, index, value):
            return Store(array, transform(index), transform(value))
        case Branch(condition, then, other):
            return Branch(transform(condition), then, other)
        case Count(timer, condition, limit, key):
            return Count(timer, transform(condition), limit, key)
    return op
