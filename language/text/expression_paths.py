"""Expression paths: the key paths of expressions in the tree of an automaton or an effect."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from language.text.document import Entry, MappingNode, ScalarNode, SequenceNode, YamlNode

KeyPath = tuple[str, ...]
"""The keys from the root of a tree to a value."""
ScalarTransform = Callable[[KeyPath, ScalarNode], ScalarNode]

ALL_SCALARS = "every scalar below"
NON_FORMULA_KEYS = frozenset({"about", "req", "kind"})
"""Keys whose values contain no expressions."""
OBSERVER_SITES = {
    key: ALL_SCALARS
    for key in ("A", "B", "C", "f", "process_noise", "measurement_noise", "at", "unknown_instant")
}
TRANSITION_SITES = {
    "when": ALL_SCALARS,
    "wait": ALL_SCALARS,
    "reset": ALL_SCALARS,
    "rewind": {"until": ALL_SCALARS, "within": ALL_SCALARS},
}
FORMULA_SECTIONS = ("equations", "flow", "terms", "update", "entry", "exit", "invariant")
MODE_SITES: dict[str, Any] = {
    **dict.fromkeys(FORMULA_SECTIONS, ALL_SCALARS),
    "observer": {**OBSERVER_SITES, "correct": ALL_SCALARS},
    "transitions": {"*": TRANSITION_SITES},
}
MODE_SITES["transition_table"] = {"columns": {"*": TRANSITION_SITES}}
MODE_SITES["modes"] = {"*": MODE_SITES}
AUTOMATON_SITES: dict[str, Any] = {
    **MODE_SITES,
    "templates": {"*": MODE_SITES},
    "regions": {"*": MODE_SITES},
    "elements": {"*": ALL_SCALARS},
    "places": {"*": ALL_SCALARS},
    "tables": {"*": {"if": ALL_SCALARS, "rows": ALL_SCALARS}},
    "instances": {"*": {"inputs": ALL_SCALARS}},
}
"""Sites of an automaton whose names an effect may replace.

Start values and parameters are excluded.
"""
EFFECT_SITES: dict[str, Any] = {
    **AUTOMATON_SITES,
    "states": {"*": {"initial": ALL_SCALARS}},
    "discrete": {"*": {"initial": ALL_SCALARS}},
    "parameters": {"*": {"derived": ALL_SCALARS}},
    "redirect": {"*": ALL_SCALARS},
}
"""Sites of the expressions that an effect contains."""


def map_formulas(
    tree: MappingNode, sites: Mapping[str, Any], transform: ScalarTransform
) -> MappingNode:
    """Return a copy of a tree in which each scalar at one of the sites is replaced by `transform`.

    `sites` maps keys to the sites below them; the key `*` stands for all keys that are not given,
    and ALL_SCALARS for every scalar at any depth below, items of sequences included, except below
    NON_FORMULA_KEYS. `transform` gets the key path from the root and the scalar; an item has the
    path of its sequence. Keys, spans and all other values stay as they are.
    """
    node = _map_node(tree, sites, transform, ())
    assert isinstance(node, MappingNode)
    return node


def _map_node(node: YamlNode, sites: Any, transform: ScalarTransform, path: KeyPath) -> YamlNode:
    """Return a node with the formulas at `sites`, relative to the node, transformed."""
    match node:
        case ScalarNode():
            return transform(path, node) if sites == ALL_SCALARS else node
        case SequenceNode(nodes, span):
            parts = (_map_node(part, sites, transform, path) for part in nodes)
            return SequenceNode(tuple(parts), span) if sites == ALL_SCALARS else node
        case MappingNode():
            entries = {}
            for key, entry in node.entries.items():
                below = _sites_below(sites, key)
                mapped = entry.node
                if below is not None:
                    mapped = _map_node(mapped, below, transform, (*path, key))
                entries[key] = Entry(key, entry.span, mapped)
            return MappingNode(entries, node.span)


def _sites_below(sites: Any, key: str) -> Any:
    """Return the sites below a key, or None if the values below the key contain no expressions."""
    if sites == ALL_SCALARS:
        return None if key in NON_FORMULA_KEYS else ALL_SCALARS
    return sites.get(key, sites.get("*"))
