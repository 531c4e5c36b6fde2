"""Description of a study: store its sections as text for readers of the results."""

from __future__ import annotations

from collections.abc import Mapping

from language.text.document import MappingNode, ScalarNode, YamlNode
from language.text.node_edit import format_inline
from language.text.sanitise import escape_invisible

Description = Mapping[str, str | Mapping[str, str]]
"""The sections of a study by key: a text, or texts by name."""
DESCRIBED_SECTIONS = ("about", "of", "scenarios", "variants", "vary", "set", "measures", "record")
"""The sections of a study that the description contains."""
NAMED_SECTIONS = ("vary", "set", "measures")
"""Sections that are described entry by entry."""


def description_of(tree: MappingNode, overrides: Mapping[str, ScalarNode]) -> Description:
    """Return the texts of the sections of a study by key, and the overrides under `--set`.

    The sections are DESCRIBED_SECTIONS; those of NAMED_SECTIONS are texts by entry. A text is one
    line of YAML. Absent sections and `--set` without overrides have no key.
    """
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
    """Return a node as one line of YAML with invisible characters escaped."""
    return escape_invisible(" ".join(format_inline(node).split()))
