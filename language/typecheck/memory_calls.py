"""Call: what functions with memory and `lookup` are, and where they may stand."""

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
from language.typecheck.types import ExprType
from language.typecheck.typing_context import TypingContext

ALLOWED_PLACES = {
    "previous": "it is for equations, updates, resets and guards of a sampled automaton",
    "delay": "it is for equations, balances, updates, resets and guards",
    **dict.fromkeys((*EDGE_FUNCTIONS, *TIME_FUNCTIONS), "it is for guards: `when`"),
}
"""What functions with memory are for."""


def infer_memory_call(checker: TypingContext, tree: FunctionCall) -> ExprType | None:
    """`delay` and `previous` have the kind of what they keep, the others are conditions."""
    name, arguments = tree.function, tree.arguments
    wanted = 2 if name == "delay" else 1
    if name not in checker.environment.memory_functions:
        label = f"`{name}` is not a function that can be used here"
        checker.problems.error("name", tree.span, label, ALLOWED_PLACES[name])
        return None
    if len(arguments) != wanted:
        label = f"`{name}` takes {wanted} argument(s), not {len(arguments)}"
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
    """`lookup(table, x)` or `lookup(table, x, y)`: each argument fits its axis."""
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
    """Return the name of the table that a `lookup` reads."""
    first = tree.arguments[0]
    return first.path if isinstance(first, Name) else "..."
