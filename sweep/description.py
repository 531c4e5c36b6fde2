"""Description: what a study says of itself, as texts for the readers of its results."""

from __future__ import annotations

from collections.abc import Mapping

from language.document import Scalar, Table
from language.tree import one_line

Description = Mapping[str, str | Mapping[str, str]]
"""The sections of a study by key: a text, or texts by name."""
SECTIONS = ("about", "of", "scenarios", "variants", "vary", "set", "measures", "record")
NAMED = ("vary", "set", "measures")
"""Sections that are told name by name."""


def description_of(tree: Table, overrides: Mapping[str, Scalar]) -> Description:
    """Return what the sections of a study say, as they are written, and what `--set` does."""
    found: dict[str, str | dict[str, str]] = {}
    for key in SECTIONS:
        node = tree.get(key)
        if isinstance(node, Table) and key in NAMED:
            found[key] = {entry.key: one_line(entry.node) for entry in node}
        elif node is not None:
            found[key] = one_line(node)
    if overrides:
        found["--set"] = {name: scalar.text for name, scalar in overrides.items()}
    return found
