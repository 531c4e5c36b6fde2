"""Equation changes: the lines of a spec that placed effects change, before and after."""

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
"""Sections of a spec that are compared; parameters have a table of their own."""


@dataclass(frozen=True)
class EquationChange:
    """A line of the spec by its key path, before and after; empty text if the line is absent."""

    path: str
    before: str
    after: str


def equation_changes(
    document: Document, placed_effects: Sequence[PlacedEffect]
) -> list[EquationChange]:
    """Return the lines of an expanded document that placed effects change, before and after.

    Raises SpecError if the effects cannot be applied.
    """
    found = diff_specs(document.root, overlay_effects(document, placed_effects).root)
    return [
        EquationChange(one.path, one.old.value if one.old else "", one.new.value if one.new else "")
        for one in found
        if one.path.partition(".")[0] in EQUATION_SECTIONS and not _is_metadata(one.path)
    ]


def _is_metadata(path: str) -> bool:
    """Return whether a key path ends with a unit, a description, a range or an initial value."""
    return path.endswith((".unit", ".about", ".range", ".initial"))
