"""Guide: which shape stands at a place of a document, so that an editor knows what fits there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from language.document import Items, Node, Scalar, Table
from language.finding import KINDS
from modewright.editing.shape import (
    Key,
    Kind,
    ListOf,
    MappingOf,
    Part,
    Shape,
    Value,
    kinds_in,
    shapes,
)


@dataclass(frozen=True)
class Place:
    """A node, the keys that lead to it, and what it is meant to be."""

    path: tuple[str, ...]
    node: Node
    kind: Kind

    @property
    def section(self) -> str:
        """The last key on the way, empty for the whole file."""
        return self.path[-1] if self.path else ""


def kind_of_file(root: Table) -> str:
    """Return the kind of a document by its keys; empty where it does not say."""
    return next((entry.key for entry in root if entry.key in KINDS), "")


def root_shape(kind: str) -> Shape | None:
    """Return the shape of a whole file; a variant has the keys of all that it may lie over."""
    shape = shapes().get(kind)
    if shape is None or not shape.over:
        return shape
    keys: dict[str, Key] = {}
    for name in reversed(shape.over):
        keys.update(shapes()[name].keys)
    for name in shape.over:
        keys.pop(name, None)
    return Shape(shape.name, shape.about, {**keys, **shape.keys}, shape.needs)


def places(root: Table, base: str = "") -> Iterator[Place]:
    """Iterate over all nodes of a document with what they are meant to be, parents first.

    `base` is the kind of what a variant is laid over, if that is known.
    """
    kind = kind_of_file(root)
    shape = root_shape(kind)
    if shape is None:
        return
    keys = dict(shape.keys)
    if kind == "variant" and base in shapes():
        keys = {**shapes()[base].keys, **shapes()[kind].keys}
    yield Place((), root, Part(kind))
    for entry in root:
        if entry.key in keys:
            yield from _below((entry.key,), entry.node, keys[entry.key].kind)


def _below(path: tuple[str, ...], node: Node, kind: Kind) -> Iterator[Place]:
    kind = fitting(node, kind)
    yield Place(path, node, kind)
    match node, kind:
        case Table(), Part(name):
            known = shapes()[name].keys
            for entry in node:
                if entry.key in known:
                    yield from _below((*path, entry.key), entry.node, known[entry.key].kind)
        case Table(), MappingOf(item, _):
            for entry in node:
                yield from _below((*path, entry.key), entry.node, item)
        case Items(), ListOf(item):
            for part in node.nodes:
                yield from _below(path, part, item)


def fitting(node: Node, kind: Kind) -> Kind:
    """Return the alternative of a kind that a node looks like most; the first where none does."""
    options = list(kinds_in(kind))
    return max(options, key=lambda option: _likeness(node, option))


def _likeness(node: Node, kind: Kind) -> float:
    """Return how much a node looks like a kind: 0 not at all, more where known keys stand."""
    match node, kind:
        case Scalar(), (ListOf() | MappingOf() | Part()):
            return 0.0
        case Scalar(), Value():
            return 1.0
        case Scalar(), _:
            return 1.5 if node.text in getattr(kind, "words", ()) else 0.5
        case Items(), ListOf():
            return 1.0
        case Table(), Part(name):
            return 1.0 + _known(node, shapes()[name])
        case Table(), MappingOf(item, _):
            inner = [max(_likeness(e.node, each) for each in kinds_in(item)) for e in node]
            return 1.0 if all(inner) else 0.5
        case _:
            return 0.0


def _known(node: Table, shape: Shape) -> float:
    """Return the share of keys that a shape knows; below zero where its words say otherwise."""
    said: Mapping[str, str] = dict(shape.when)
    for key, word in said.items():
        value = node.get(key)
        if isinstance(value, Scalar) and value.text != word:
            return -0.9
    return sum(entry.key in shape.keys for entry in node) / max(1, len(node.entries))
