"""Call: what functions with memory and `lookup` are, and where they may stand."""

from __future__ import annotations

from typing import TYPE_CHECKING

from language.problem import nearest
from language.syntax import EDGES, KEPT, TIMES, Application, Name
from language.units import SECOND

if TYPE_CHECKING:
    from language.dimension import DimensionCheck
    from language.kind import Kind

WHERE = {
    "previous": "it is for equations, updates, resets and guards of a sampled automaton",
    "delay": "it is for equations, balances, updates, resets and guards",
    **dict.fromkeys((*EDGES, *TIMES), "it is for guards: `when`"),
}
"""What functions with memory are for."""


def memory_kind(check: DimensionCheck, tree: Application) -> Kind | None:
    """`delay` and `previous` have the kind of what they keep, the others are conditions."""
    name, arguments = tree.function, tree.arguments
    wanted = 2 if name == "delay" else 1
    if name not in check.scope.memory:
        label = f"`{name}` is not a function that can be used here"
        check.problems.error("name", tree.span, label, WHERE[name])
        return None
    if len(arguments) != wanted:
        label = f"`{name}` takes {wanted} argument(s), not {len(arguments)}"
        hint = f"a time has its unit: `{name}(5 s)`" if name in TIMES else ""
        check.problems.error("arguments", tree.span, label, hint)
        return None
    if name in ("delay", *TIMES):
        check.quantity(arguments[-1], SECOND, f"the time of {name}")
    inside = check.remembering(*KEPT)
    if name in KEPT:
        return inside.kind(arguments[0])
    if name == "changed":
        return "truth" if inside.kind(arguments[0]) is not None else None
    if name in EDGES:
        inside.truth(arguments[0], name)
    return "truth"


def lookup_kind(check: DimensionCheck, tree: Application) -> Kind | None:
    """`lookup(table, x)` or `lookup(table, x, y)`: each argument fits its axis."""
    first, *arguments = tree.arguments
    table = check.scope.tables.get(first.path) if isinstance(first, Name) else None
    if table is None:
        shown = f"`{first.path}`" if isinstance(first, Name) else "this"
        hint = nearest(shown.strip("`"), check.scope.tables)
        check.problems.error("table", first.span, f"{shown} is not a table", hint)
        return None
    if len(arguments) != len(table.axes):
        label = f"`{shown_table(tree)}` has {len(table.axes)} axis(es), not {len(arguments)}"
        check.problems.error("arguments", tree.span, label)
        return None
    for argument, axis in zip(arguments, table.axes, strict=True):
        check.quantity(argument, axis.unit.dimension, f"the axis {axis.name}")
    return table.unit.dimension


def shown_table(tree: Application) -> str:
    """Return the name of the table that a `lookup` reads."""
    first = tree.arguments[0]
    return first.path if isinstance(first, Name) else "..."
