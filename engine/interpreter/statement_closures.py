"""Statement closures: operations of a Program as Python functions of one frame.

Short sequences of statements and assignments are single functions, because a Python call is
expensive.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from engine.interpreter.expression_closures import ExpressionClosure, Frame

StatementClosure = Callable[[Frame], None]
"""Function that executes a statement in a frame."""


def no_op(v: Frame) -> None:
    """Do nothing."""


def sequence(statements: Sequence[StatementClosure]) -> StatementClosure:
    """Return the closure that runs statements in order.

    Each `no_op` is dropped. Without others the result is `no_op`; a single one is returned itself.
    """
    match [action for action in statements if action is not no_op]:
        case []:
            return no_op
        case [only]:
            return only
        case [first, second]:

            def two(v: Frame) -> None:
                first(v)
                second(v)

            return two
        case [first, second, third]:

            def three(v: Frame) -> None:
                first(v)
                second(v)
                third(v)

            return three
        case all_statements:

            def act(v: Frame) -> None:
                for action in all_statements:
                    action(v)

            return act


def assign(targets: Sequence[int], values: Sequence[ExpressionClosure]) -> StatementClosure:
    """Return the closure that assigns the values to the target slots, one after the other.

    A later value sees the earlier assignments. Raises ValueError unless there are one to four
    targets and as many values.
    """
    match targets, values:
        case [s], [a]:

            def one(v: Frame) -> None:
                v[s] = a(v)

            return one
        case [s, t], [a, b]:

            def two(v: Frame) -> None:
                v[s] = a(v)
                v[t] = b(v)

            return two
        case [s, t, u], [a, b, c]:

            def three(v: Frame) -> None:
                v[s] = a(v)
                v[t] = b(v)
                v[u] = c(v)

            return three
        case [s, t, u, w], [a, b, c, d]:

            def four(v: Frame) -> None:
                v[s] = a(v)
                v[t] = b(v)
                v[u] = c(v)
                v[w] = d(v)

            return four
    raise ValueError(f"{len(targets)} variables")


def copy(targets: Sequence[int], sources: Sequence[int]) -> StatementClosure:
    """Return the closure that copies source slots to target slots, one after the other.

    A later copy sees the earlier ones. Raises ValueError unless there are one to four targets and
    as many sources.
    """
    match targets, sources:
        case [s], [a]:

            def one(v: Frame) -> None:
                v[s] = v[a]

            return one
        case [s, t], [a, b]:

            def two(v: Frame) -> None:
                v[s] = v[a]
                v[t] = v[b]

            return two
        case [s, t, u], [a, b, c]:

            def three(v: Frame) -> None:
                v[s] = v[a]
                v[t] = v[b]
                v[u] = v[c]

            return three
        case [s, t, u, w], [a, b, c, d]:

            def four(v: Frame) -> None:
                v[s] = v[a]
                v[t] = v[b]
                v[u] = v[c]
                v[w] = v[d]

            return four
    raise ValueError(f"{len(targets)} variables")


def store(slot: int, index: ExpressionClosure, value: ExpressionClosure) -> StatementClosure:
    """Return the closure that sets an element of the array in `slot`.

    The value is evaluated before the index.
    """

    def act(v: Frame) -> None:
        v[slot][index(v)] = value(v)

    return act


def branch(
    condition: ExpressionClosure, if_true: StatementClosure, if_false: StatementClosure
) -> StatementClosure:
    """Return the closure of an if statement; an absent branch is `no_op`.

    If both branches are `no_op`, the result is `no_op`, since conditions have no effect.
    """
    if if_true is no_op and if_false is no_op:
        return no_op
    if if_false is no_op:

        def act_or_not(v: Frame) -> None:
            if condition(v):
                if_true(v)

        return act_or_not

    def act(v: Frame) -> None:
        if condition(v):
            if_true(v)
        else:
            if_false(v)

    return act


def switch_case(slot: int, table: Mapping[int, StatementClosure]) -> StatementClosure:
    """Return the closure that runs the statement of `table` for the number in a slot.

    Other numbers do nothing. The result is `no_op` if all statements are.
    """
    if all(action is no_op for action in table.values()):
        return no_op

    def act(v: Frame) -> None:
        table.get(v[slot], no_op)(v)

    return act


def loop(count: int, slot: int, body: StatementClosure) -> StatementClosure:
    """Return the closure of a loop of `count` turns; `slot` has the index of the turn from 0.

    After the loop the slot keeps the last index.
    """

    def act(v: Frame) -> None:
        for index in range(count):
            v[slot] = index
            body(v)

    return act


def loop_while(
    count: int, slot: int, condition: ExpressionClosure, body: StatementClosure
) -> StatementClosure:
    """Return the closure of a loop of at most `count` turns that ends when a condition is false.

    The condition is evaluated before each turn, after `slot` is set to the index from 0. It does
    not depend on the index, so it would remain false in the remaining turns.
    """

    def act(v: Frame) -> None:
        for index in range(count):
            v[slot] = index
            if not condition(v):
                break
            body(v)

    return act


def count_while(slot: int, condition: ExpressionClosure, limit: int) -> StatementClosure:
    """Return the closure that updates a counter in a slot.

    If the condition holds, the counter is increased by 1 up to `limit`, else it is set to 0.
    """

    def act(v: Frame) -> None:
        if condition(v):
            number = v[slot]
            v[slot] = number + 1 if number < limit else limit
        else:
            v[slot] = 0

    return act


def set_fault(slot: int, bit: int, signal: str, violations_slot: int) -> StatementClosure:
    """Return the closure that sets the bits of the mask `bit` in the variable at `slot`.

    It adds `signal` to the dict at `violations_slot`, as having left its range, unless the name is
    empty.
    """

    def act(v: Frame) -> None:
        v[slot] |= bit
        if signal:
            v[violations_slot][signal] = None

    return act


def clear_fault(slot: int, bit: int) -> StatementClosure:
    """Return the closure that clears the bits of the mask `bit` in the variable at `slot`."""

    def act(v: Frame) -> None:
        v[slot] &= ~bit

    return act
