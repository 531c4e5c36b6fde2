"""Requirement: the names of the requirements that something of a spec fulfils, `req: [BL-3]`."""

from __future__ import annotations

from language.document import Items, Scalar, Table


def requirements_of(table: Table) -> tuple[str, ...]:
    """Return the names under `req`: one, or a list."""
    node = table.get("req")
    if isinstance(node, Scalar):
        return (node.text,)
    if isinstance(node, Items):
        return tuple(item.text for item in node.nodes if isinstance(item, Scalar))
    return ()
