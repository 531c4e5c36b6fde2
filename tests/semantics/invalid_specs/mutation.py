"""Spoiling: a spec with a few of its keys and values taken away, doubled or of another type."""

from __future__ import annotations

import copy
import random

import yaml

JUNK = (
    *("", "{}", "[]", "[1]", "[[]]", "[a, a]", "{a: 1}", "{value: }", "{about: x}", "~"),
    *("0", "-1", "1e400", ".nan", "true", "x", "a.b.c", "1 s", "1 parsec", "in(x)", "stay"),
    *("always", "-", "after(1 s)", "not changed(x)", "[1, 0]", "previous(x) + 1 V", "x; y"),
)
"""What stands in place of a value."""
KEYS = (
    *("value", "range", "unit", "initial", "transitions", "modes", "regions", "history", "final"),
    *("tables", "event", "wait", "derived", "type", "when", "extends", "of", "to", "entry"),
)
"""What stands in place of a key."""


def spoil_spec(text: str, chance: random.Random) -> str:
    """Return a spec with one to three places spoilt, as text."""
    root = yaml.compose(text)
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        _spoil(_parents(root), chance)
    return yaml.serialize(root, width=10_000)


def _parents(node: yaml.Node | None) -> list[yaml.CollectionNode]:
    """Return all mappings and lists of a tree that hold something, outer ones first."""
    if not isinstance(node, yaml.CollectionNode) or not node.value:
        return []
    mapped = isinstance(node, yaml.MappingNode)
    children = [each for pair in node.value for each in pair] if mapped else node.value
    return [node, *(parent for child in children for parent in _parents(child))]


def _spoil(parents: list[yaml.CollectionNode], chance: random.Random) -> None:
    parent = chance.choice(parents)
    values, place = parent.value, chance.randrange(len(parent.value))
    mapped = isinstance(parent, yaml.MappingNode)
    key = values[place][0] if mapped else None
    junk = yaml.compose(chance.choice(JUNK) or "''")
    match chance.choice(("take", "take", "junk", "junk", "double", "key", "other")):
        case "take":
            del values[place]
        case "junk":
            values[place] = (key, junk) if mapped else junk
        case "double":
            values.insert(place, copy.deepcopy(values[place]))
        case "key" if mapped:
            values[place] = (yaml.ScalarNode("tag:yaml.org,2002:str", chance.choice(KEYS)), junk)
        case _:
            other = copy.deepcopy(chance.choice(chance.choice(parents).value))
            if isinstance(other, tuple):
                other = other[1]
            values[place] = (key, other) if mapped else other
