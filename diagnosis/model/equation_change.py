"""Change: which equations of the model an effect alters, before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from diagnosis.model.placed_effect import PlacedEffect, overlay_effects
from language.text.document import Document
from language.text.provenance import diff_specs

EQUATION_SECTIONS = (
    "inputs",
    "states",
    "equations",
    "flow",
    "terms",
    "modes",
    "regions",
    "outputs",
)
"""What is told; parameters have a table of their own."""


@dataclass(frozen=True)
class EquationChange:
    """A line of the spec, by its key path, without and with the effects; empty where absent."""

    path: str
    before: str
    after: str


def equation_changes(
    document: Document, placed_effects: Sequence[PlacedEffect]
) -> list[EquationChange]:
    """Return the lines of equations that layers alter in an expanded document. Raises SpecError."""
    found = diff_specs(document.root, overlay_effects(document, placed_effects).root)
    return [
        EquationChange(one.path, one.old.value if one.old else "", one.new.value if one.new else "")
        for one in found
        if one.path.partition(".")[0] in EQUATION_SECTIONS and not _is_metadata(one.path)
    ]


def _is_metadata(path: str) -> bool:
    return path.endswith((".unit", ".about", ".range", ".initial"))
