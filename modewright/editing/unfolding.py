"""Unfolding: the modes of a spec with their templates laid under them."""

from __future__ import annotations

from language.document import Entry, Node, Scalar, Table
from language.overlay import lay, without
from language.problem import Problems


def unfolded(root: Table) -> Table:
    """Return the tree of a spec in which no mode is `like` a template any more."""
    templates = root.get("templates")
    known = templates if isinstance(templates, Table) else Table({}, root.span)
    made = _below(without(root, "templates"), known)
    return made if isinstance(made, Table) else root


def _below(node: Node, templates: Table) -> Node:
    if not isinstance(node, Table):
        return node
    found = {}
    for entry in node:
        below = entry.node
        if entry.key == "modes" and isinstance(below, Table):
            modes = {e.key: Entry(e.key, e.span, _mode(e.node, templates)) for e in below}
            below = Table(modes, below.span)
        elif entry.key == "regions":
            below = _regions(below, templates)
        found[entry.key] = Entry(entry.key, entry.span, below)
    return Table(found, node.span)


def _regions(node: Node, templates: Table) -> Node:
    if not isinstance(node, Table):
        return node
    regions = {e.key: Entry(e.key, e.span, _below(e.node, templates)) for e in node}
    return Table(regions, node.span)


def _mode(node: Node, templates: Table) -> Node:
    if not isinstance(node, Table):
        return node
    like = node.get("like")
    template = templates.get(like.text) if isinstance(like, Scalar) else None
    if isinstance(template, Table):
        node = lay(template, without(node, "like"), Problems(), template=True)
    return _below(node, templates)
