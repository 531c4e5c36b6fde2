"""Change: which equations of the model an effect alters, before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from diagnosis.layers import Layer, laid
from language.document import Document
from language.provenance import differences

SECTIONS = ("inputs", "states", "equations", "flow", "terms", "modes", "regions", "outputs")
"""What is told; parameters have a table of their own."""


@dataclass(frozen=True)
class Change:
    """A line of the spec, by its key path, without and with the effects; empty where absent."""

    path: str
    before: str
    after: str


def changes(document: Document, layers: Sequence[Layer]) -> list[Change]:
    """Return the lines of equations that layers alter in an expanded document. Raises SpecError."""
    found = differences(document.root, laid(document, layers).root)
    return [
        Change(one.path, one.old.value if one.old else "", one.new.value if one.new else "")
        for one in found
        if one.path.partition(".")[0] in SECTIONS and not _is_aside(one.path)
    ]


def _is_aside(path: str) -> bool:
    return path.endswith((".unit", ".about", ".range", ".initial"))
