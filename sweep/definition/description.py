"""Description: what a study says of itself, as texts for the readers of its results."""

from __future__ import annotations

from collections.abc import Mapping

from language.text.document import MappingNode, ScalarNode, YamlNode
from language.text.node_edit import format_inline
from language.text.sanitise import escape_invisible

Description = Mapping[str, str | Mapping[str, str]]
"""The sections of a study by key: a text, or texts by name."""
DESCRIBED_SECTIONS = ("about", "of", "scenarios", "variants", "vary", "set", "measures", "record")
NAMED_SECTIONS = ("vary", "set", "measures")
"""Sections that are told name by name."""


def description_of(tree: MappingNode, overrides: Mapping[str, ScalarNode]) -> Description:
    """Return what the sections of a study say, as they are written, and what `--set` does."""
    found: dict[str, str | dict[str, str]] = {}
    for key in DESCRIBED_SECTIONS:
        node = tree.get(key)
        if isinstance(node, MappingNode) and key in NAMED_SECTIONS:
            found[key] = {entry.key: _text_of(entry.node) for entry in node}
        elif node is not None:
            found[key] = _text_of(node)
    if overrides:
        found["--set"] = {name: _text_of(scalar) for name, scalar in overrides.items()}
    return found


def _text_of(node: YamlNode) -> str:
    """Return a node as one line; what is not seen is written as an escape."""
    return escape_invisible(" ".join(format_inline(node).split()))
