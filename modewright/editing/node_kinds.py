"""Node kinds: assign to each node of a document the kind of value that is expected there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from language.text.document import MappingNode, ScalarNode, SequenceNode, YamlNode
from language.text.project_files import DOCUMENT_KINDS
from modewright.editing.key_shape import (
    Key,
    ListOf,
    MappingOf,
    Shape,
    ShapeRef,
    Value,
    ValueKind,
    alternatives_of,
    shapes,
)


@dataclass(frozen=True)
class Place:
    """A node with the keys that lead to it and the expected kind."""

    path: tuple[str, ...]
    node: YamlNode
    kind: ValueKind

    @property
    def section(self) -> str:
        """The last key of the path; empty for the root."""
        return self.path[-1] if self.path else ""


def kind_of_file(root: MappingNode) -> str:
    """Return the first key of a root that is one of DOCUMENT_KINDS; empty if there is none."""
    return next((entry.key for entry in root if entry.key in DOCUMENT_KINDS), "")


def root_shape(kind: str) -> Shape | None:
    """Return the shape of a whole file of a kind; None for an unknown kind.

    The shape of a variant has the keys of all kinds that it may overlay, except their head keys.
    """
    shape = shapes().get(kind)
    if shape is None or not shape.overlay_kinds:
        return shape
    keys: dict[str, Key] = {}
    for name in reversed(shape.overlay_kinds):
        keys.update(shapes()[name].keys)
    for name in shape.overlay_kinds:
        keys.pop(name, None)
    return Shape(shape.name, shape.about, {**keys, **shape.keys}, shape.required)


def places(root: MappingNode, base: str = "") -> Iterator[Place]:
    """Yield the nodes of a document whose kind is known, with this kind, parents first.

    Nodes below unknown keys are left out; nothing is yielded for a document of unknown kind. `base`
    is the kind of the base of a variant, whose keys are then expected; without it those of all
    kinds.
    """
    kind = kind_of_file(root)
    shape = root_shape(kind)
    if shape is None:
        return
    keys = dict(shape.keys)
    if kind == "variant" and base in shapes():
        keys = {**shapes()[base].keys, **shapes()[kind].keys}
    yield Place((), root, ShapeRef(kind))
    for entry in root:
        if entry.key in keys:
            yield from _iter_below((entry.key,), entry.node, keys[entry.key].kind)


def _iter_below(path: tuple[str, ...], node: YamlNode, kind: ValueKind) -> Iterator[Place]:
    """Yield a node and the nodes below it."""
    kind = select_alternative(node, kind)
    yield Place(path, node, kind)
    match node, kind:
        case MappingNode(), ShapeRef(name):
            known = shapes()[name].keys
            for entry in node:
                if entry.key in known:
                    yield from _iter_below((*path, entry.key), entry.node, known[entry.key].kind)
        case MappingNode(), MappingOf(item, _):
            for entry in node:
                yield from _iter_below((*path, entry.key), entry.node, item)
        case SequenceNode(), ListOf(item):
            for part in node.nodes:
                yield from _iter_below(path, part, item)


def select_alternative(node: YamlNode, kind: ValueKind) -> ValueKind:
    """Return the alternative of a kind that fits a node best; the first one in case of a tie.

    A fitting structure (scalar, list, mapping) counts most, then a word of a choice or the fraction
    of known keys.
    """
    options = list(alternatives_of(kind))
    return max(options, key=lambda option: _match_score(node, option))


def _match_score(node: YamlNode, kind: ValueKind) -> float:
    """Return how well a node fits a kind: 0 for not at all, larger with more known keys."""
    match node, kind:
        case ScalarNode(), (ListOf() | MappingOf() | ShapeRef()):
            return 0.0
        case ScalarNode(), Value():
            return 1.0
        case ScalarNode(), _:
            return 1.5 if node.text in getattr(kind, "words", ()) else 0.5
        case SequenceNode(), ListOf():
            return 1.0
        case MappingNode(), ShapeRef(name):
            return 1.0 + _known_key_share(node, shapes()[name])
        case MappingNode(), MappingOf(item, _):
            inner = [
                max(_match_score(e.node, each) for each in alternatives_of(item)) for e in node
            ]
            return 1.0 if all(inner) else 0.5
        case _:
            return 0.0


def _known_key_share(node: MappingNode, shape: Shape) -> float:
    """Return the fraction of keys that a shape knows; -0.9 if a discriminator differs."""
    expected_words: Mapping[str, str] = dict(shape.discriminators)
    for key, word in expected_words.items():
        value = node.get(key)
        if isinstance(value, ScalarNode) and value.text != word:
            return -0.9
    return sum(entry.key in shape.keys for entry in node) / max(1, len(node.entries))
