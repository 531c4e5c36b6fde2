"""Passage: where expressions stand in the tree of an automaton or an effect."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from language.document import Entry, Items, Node, Scalar, Table

Path = tuple[str, ...]
"""The keys from the root of a tree to a value."""
Change = Callable[[Path, Scalar], Scalar]

EVERY = "every scalar below"
TEXTS = frozenset({"about", "req", "kind"})
"""Keys inside whose values are no expressions."""
OBSERVER = {
    key: EVERY
    for key in ("A", "B", "C", "f", "process_noise", "measurement_noise", "at", "unknown_instant")
}
TRANSITION = {
    "when": EVERY,
    "wait": EVERY,
    "reset": EVERY,
    "rewind": {"until": EVERY, "within": EVERY},
}
FORMULAS = ("equations", "flow", "terms", "update", "entry", "exit", "invariant")
MODE: dict[str, Any] = {
    **dict.fromkeys(FORMULAS, EVERY),
    "observer": {**OBSERVER, "correct": EVERY},
    "transitions": {"*": TRANSITION},
}
MODE["transition_table"] = {"columns": {"*": TRANSITION}}
MODE["modes"] = {"*": MODE}
AUTOMATON: dict[str, Any] = {
    **MODE,
    "templates": {"*": MODE},
    "regions": {"*": MODE},
    "elements": {"*": EVERY},
    "places": {"*": EVERY},
    "tables": {"*": {"if": EVERY, "rows": EVERY}},
    "instances": {"*": {"inputs": EVERY}},
}
"""Expressions that effects may redirect; start values and parameters are not among them."""
EFFECT: dict[str, Any] = {
    **AUTOMATON,
    "states": {"*": {"initial": EVERY}},
    "discrete": {"*": {"initial": EVERY}},
    "parameters": {"*": {"derived": EVERY}},
    "redirect": {"*": EVERY},
}
"""Expressions that an effect brings."""


def changed(tree: Table, shape: Mapping[str, Any], change: Change) -> Table:
    """Return a tree in which every expression is what `change` makes of it."""
    node = _changed(tree, shape, change, ())
    assert isinstance(node, Table)
    return node


def _changed(node: Node, shape: Any, change: Change, path: Path) -> Node:
    match node:
        case Scalar():
            return change(path, node) if shape == EVERY else node
        case Items(nodes, span):
            parts = (_changed(part, shape, change, path) for part in nodes)
            return Items(tuple(parts), span) if shape == EVERY else node
        case Table():
            entries = {}
            for key, entry in node.entries.items():
                below = _shape_of(shape, key)
                kept = entry.node
                if below is not None:
                    kept = _changed(kept, below, change, (*path, key))
                entries[key] = Entry(key, entry.span, kept)
            return Table(entries, node.span)


def _shape_of(shape: Any, key: str) -> Any:
    if shape == EVERY:
        return None if key in TEXTS else EVERY
    return shape.get(key, shape.get("*"))
