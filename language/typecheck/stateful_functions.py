"""Stateful functions: types of functions with memory and of `lookup`, and where they are
allowed."""

from __future__ import annotations

from language.expressions.syntax_tree import (
    DELAY_FUNCTIONS,
    EDGE_FUNCTIONS,
    TIME_FUNCTIONS,
    FunctionCall,
    Name,
)
from language.expressions.units import SECOND
from language.text.diagnostic import suggest_name
from language.typecheck.checker_protocol import TypingContext
from language.typecheck.types import ExprType

ALLOWED_PLACES = {
    "previous": "it is for equations, updates, resets and guards of a sampled automaton",
    "delay": "it is for equations, balances, updates, resets and guards",
    **dict.fromkeys((*EDGE_FUNCTIONS, *TIME_FUNCTIONS), "it is for guards: `when`"),
}
"""Help text for each function with memory at a place where it is not allowed."""


def infer_memory_call(checker: TypingContext, tree: FunctionCall) -> ExprType | None:
    """Return the type of a call of a function with memory; None if the call is not valid.

    `delay` and `previous` have the type of their first argument; the others are truth values.
    Reported are a function that is not allowed here and a wrong number of arguments (both give
    None), a time that is not in seconds, and problems of the arguments; inside them only `delay`
    and `previous` are allowed.
    """
    name, arguments = tree.function, tree.arguments
    expected = 2 if name == "delay" else 1
    if name not in checker.environment.memory_functions:
        label = f"`{name}` is not a function that can be used here"
        checker.problems.error("name", tree.span, label, ALLOWED_PLACES[name])
        return None
    if len(arguments) != expected:
        label = f"`{name}` takes {expected} argument(s), not {len(arguments)}"
        hint = f"a time has its unit: `{name}(5 s)`" if name in TIME_FUNCTIONS else ""
        checker.problems.error("arguments", tree.span, label, hint)
        return None
    if name in ("delay", *TIME_FUNCTIONS):
        checker.check_quantity(arguments[-1], SECOND, f"the time of {name}")
    inside = checker.inside_memory_function(*DELAY_FUNCTIONS)
    if name in DELAY_FUNCTIONS:
        return inside.infer_type(arguments[0])
    if name == "changed":
        return "truth" if inside.infer_type(arguments[0]) is not None else None
    if name in EDGE_FUNCTIONS:
        inside.check_condition(arguments[0], name)
    return "truth"


def infer_lookup(checker: TypingContext, tree: FunctionCall) -> ExprType | None:
    """Return the dimension of `lookup(table, x)` or `lookup(table, x, y)`; report unfit arguments.

    None is returned if there is no such table or the number of arguments is not that of its axes.
    An argument of another dimension than its axis is reported only.
    """
    first, *arguments = tree.arguments
    table = checker.environment.tables.get(first.path) if isinstance(first, Name) else None
    if table is None:
        shown = f"`{first.path}`" if isinstance(first, Name) else "this"
        hint = suggest_name(shown.strip("`"), checker.environment.tables)
        checker.problems.error("table", first.span, f"{shown} is not a table", hint)
        return None
    if len(arguments) != len(table.axes):
        label = f"`{table_name_of(tree)}` has {len(table.axes)} axis(es), not {len(arguments)}"
        checker.problems.error("arguments", tree.span, label)
        return None
    for argument, axis in zip(arguments, table.axes, strict=True):
        checker.check_quantity(argument, axis.unit.dimension, f"the axis {axis.name}")
    return table.unit.dimension


def table_name_of(tree: FunctionCall) -> str:
    """Return the name of the table of a `lookup`; `...` if its first argument is not a name."""
    first = tree.arguments[0]
    return first.path if isinstance(first, Name) else "..."
