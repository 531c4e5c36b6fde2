"""Unfolding: the modes of a spec with their templates laid under them."""

from __future__ import annotations

from language.text.diagnostic import Problems
from language.text.document import Entry, MappingNode, ScalarNode, YamlNode
from language.text.overlay import apply_overlay, without_keys


def expand_templates(root: MappingNode) -> MappingNode:
    """Return the tree of a spec in which no mode is `like` a template any more."""
    templates = root.get("templates")
    known = templates if isinstance(templates, MappingNode) else MappingNode({}, root.span)
    made = _expand_node(without_keys(root, "templates"), known)
    return made if isinstance(made, MappingNode) else root


def _expand_node(node: YamlNode, templates: MappingNode) -> YamlNode:
    if not isinstance(node, MappingNode):
        return node
    found = {}
    for entry in node:
        below = entry.node
        if entry.key == "modes" and isinstance(below, MappingNode):
            modes = {e.key: Entry(e.key, e.span, _expand_mode(e.node, templates)) for e in below}
            below = MappingNode(modes, below.span)
        elif entry.key == "regions":
            below = _expand_regions(below, templates)
        found[entry.key] = Entry(entry.key, entry.span, below)
    return MappingNode(found, node.span)


def _expand_regions(node: YamlNode, templates: MappingNode) -> YamlNode:
    if not isinstance(node, MappingNode):
        return node
    regions = {e.key: Entry(e.key, e.span, _expand_node(e.node, templates)) for e in node}
    return MappingNode(regions, node.span)


def _expand_mode(node: YamlNode, templates: MappingNode) -> YamlNode:
    if not isinstance(node, MappingNode):
        return node
    like = node.get("like")
    template = templates.get(like.text) if isinstance(like, ScalarNode) else None
    if isinstance(template, MappingNode):
        node = apply_overlay(template, without_keys(node, "like"), Problems(), template=True)
    return _expand_node(node, templates)
