"""Requirement: names of requirements that something of a spec fulfils, `req: [BL-3]`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from language.document import Items, Node, Scalar, Table
from language.problem import Span


@dataclass(frozen=True)
class Named:
    """A requirement named at a key path, empty for the whole file."""

    requirement: str
    path: str
    span: Span


def requirements_of(table: Table) -> tuple[str, ...]:
    """Return the names under `req`: one, or a list."""
    return tuple(item.text for item in _items(table))


def requirements_in(node: Node, path: tuple[str, ...] = ()) -> Iterator[Named]:
    """Yield every requirement that is named in a tree, in the order of the file."""
    if not isinstance(node, Table):
        return
    for item in _items(node):
        yield Named(item.text, ".".join(path), item.span)
    for entry in node:
        yield from requirements_in(entry.node, (*path, entry.key))


def all_requirements(*trees: Table) -> tuple[str, ...]:
    """Return the requirements that are named in trees, each once."""
    return tuple(dict.fromkeys(each.requirement for t in trees for each in requirements_in(t)))


def _items(table: Table) -> Iterator[Scalar]:
    node = table.get("req")
    nodes = node.nodes if isinstance(node, Items) else (node,)
    yield from (each for each in nodes if isinstance(each, Scalar) and each.text)
