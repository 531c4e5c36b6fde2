"""Tree: looking into a document's tree and changing one place of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

from language.document import Entry, Items, Node, Scalar, Table
from language.problem import Source, Span


def entries(node: Node | None) -> Iterator[Entry]:
    """Iterate over the entries of a mapping; over nothing where there is none."""
    if isinstance(node, Table):
        yield from node


def items_of(node: Node | None) -> tuple[Scalar, ...]:
    """Return the scalars of a list; of a single one, itself."""
    if isinstance(node, Items):
        return tuple(item for item in node.nodes if isinstance(item, Scalar))
    return (node,) if isinstance(node, Scalar) else ()


def at(tree: Table, path: Sequence[str]) -> Node | None:
    """Return what stands under a path of keys, or None."""
    node: Node | None = tree
    for key in path:
        node = node.get(key) if isinstance(node, Table) else None
    return node


def put(tree: Table, path: Sequence[str], node: Node) -> Table:
    """Return a tree with a node under a path of keys; what is absent on the way is made."""
    key, *rest = path
    if rest:
        below = tree.get(key)
        table = below if isinstance(below, Table) else Table({}, node.span)
        node = put(table, rest, node)
    present = tree.entries.get(key)
    entry = Entry(key, present.span if present else node.span, node)
    return Table({**tree.entries, key: entry}, tree.span)


def resourced(node: Node, source: Source) -> Node:
    """Return a tree whose places are in another source."""
    span = _within(node.span, source)
    match node:
        case Scalar():
            return dataclasses.replace(node, span=span)
        case Items():
            return Items(tuple(resourced(part, source) for part in node.nodes), span)
        case Table():
            made = {
                entry.key: Entry(
                    entry.key, _within(entry.span, source), resourced(entry.node, source)
                )
                for entry in node
            }
            return Table(made, span)


def _within(span: Span, source: Source) -> Span:
    return dataclasses.replace(span, source=source)


def one_line(node: Node) -> str:
    """Return a node as YAML in one line: `{points: {0 degC: 10 N*m, 40 degC: 12.5 N*m}}`."""
    if isinstance(node, Table):
        return f"{{{', '.join(f'{entry.key}: {one_line(entry.node)}' for entry in node)}}}"
    if isinstance(node, Items):
        return f"[{', '.join(one_line(item) for item in node.nodes)}]"
    return node.text
