"""Node edits: functions that search a tree of nodes or return a changed copy of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

from language.text.diagnostic import Source, Span
from language.text.document import Entry, MappingNode, ScalarNode, SequenceNode, YamlNode


def mapping_entries(node: YamlNode | None) -> Iterator[Entry]:
    """Yield the entries of a mapping in the order of the file.

    A scalar, a sequence and None have no entries.
    """
    if isinstance(node, MappingNode):
        yield from node


def scalars_of(node: YamlNode | None) -> tuple[ScalarNode, ...]:
    """Return the scalars among the items of a sequence, or a scalar itself as a tuple.

    Nested sequences and mappings are left out. A mapping, or None, gives an empty tuple.
    """
    if isinstance(node, SequenceNode):
        return tuple(item for item in node.nodes if isinstance(item, ScalarNode))
    return (node,) if isinstance(node, ScalarNode) else ()


def find_node(tree: MappingNode, path: Sequence[str]) -> YamlNode | None:
    """Return the node at a path of keys, or None if a key is absent or a value above is no mapping.

    An empty path gives the tree itself.
    """
    node: YamlNode | None = tree
    for key in path:
        node = node.get(key) if isinstance(node, MappingNode) else None
    return node


def put_node(tree: MappingNode, path: Sequence[str], node: YamlNode) -> MappingNode:
    """Return a copy of a tree with `node` at a path of keys; create missing mappings.

    A value at the path is replaced, and so is a scalar or a sequence above it (by a mapping). A key
    that exists already keeps its place and its span; a new one comes last and has the span of
    `node`. Raises ValueError for an empty path.
    """
    key, *rest = path
    if rest:
        below = tree.get(key)
        table = below if isinstance(below, MappingNode) else MappingNode({}, node.span)
        node = put_node(table, rest, node)
    present = tree.entries.get(key)
    entry = Entry(key, present.span if present else node.span, node)
    return MappingNode({**tree.entries, key: entry}, tree.span)


def replace_source(node: YamlNode, source: Source) -> YamlNode:
    """Return a copy of a tree in which the spans of all keys and values refer to `source`.

    Lines and columns stay the same, and so do the `changes` of scalars.
    """
    span = _replace_span_source(node.span, source)
    match node:
        case ScalarNode():
            return dataclasses.replace(node, span=span)
        case SequenceNode():
            return SequenceNode(tuple(replace_source(part, source) for part in node.nodes), span)
        case MappingNode():
            new_entries = {
                entry.key: Entry(
                    entry.key,
                    _replace_span_source(entry.span, source),
                    replace_source(entry.node, source),
                )
                for entry in node
            }
            return MappingNode(new_entries, span)


def _replace_span_source(span: Span, source: Source) -> Span:
    """Return a copy of a span that refers to `source`."""
    return dataclasses.replace(span, source=source)


def format_inline(node: YamlNode) -> str:
    """Return a node as YAML on one line: `{points: {0 degC: 10 N*m, 40 degC: 12.5 N*m}}`.

    A sequence is `[a, b]`. Scalars and keys are printed without quotes, even if YAML needs them.
    """
    if isinstance(node, MappingNode):
        return f"{{{', '.join(f'{entry.key}: {format_inline(entry.node)}' for entry in node)}}}"
    if isinstance(node, SequenceNode):
        return f"[{', '.join(format_inline(item) for item in node.nodes)}]"
    return node.text
