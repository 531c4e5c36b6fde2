"""Effect folders: effects that a user supplies in place of the shipped library."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from diagnosis.model.placed_effect import (
    PlacedEffect,
    automaton_with_effects,
    find_placements,
    read_effects,
)
from language.overlays.effect_reader import Effect
from language.overlays.expand_document import Project
from language.text.diagnostic import Problems, SpecError
from language.text.document import Document


def load_effects(folder: Path) -> tuple[Effect, ...]:
    """Return the effects of the `*.yaml` files directly in a folder, sorted by file name.

    Raises ValueError without any, and SpecError for an invalid file or a name that is there twice.
    """
    effects = read_effects(folder)
    if not effects:
        raise ValueError(f"there is no effect in {folder}")
    problems, first = Problems(), dict[str, Effect]()
    for effect in effects:
        previous = first.setdefault(effect.name, effect)
        if previous is not effect:
            label = f"effect `{effect.name}` is defined twice"
            problems.error("name", effect.span, label, f"it is first at {previous.span}")
    problems.raise_if_errors()
    return effects


def explain_unplaceable(
    effects: Sequence[Effect], document: Document, project: Project
) -> Iterator[str]:
    """Yield why each effect cannot be placed, for those that are valid at no place."""
    for effect in effects:
        placed_effects = find_placements(document, effect)
        errors = [_placement_error(one, document, project) for one in placed_effects]
        if all(errors):
            why = next(iter(errors), f"it fits no place of `{document.name}`")
            yield f"effect `{effect.name}` is not tried: {why}"


def _placement_error(placed_effect: PlacedEffect, document: Document, project: Project) -> str:
    """Return why an effect at a matching place makes the automaton invalid; "" if it is valid."""
    try:
        automaton_with_effects(document, project, [placed_effect])
    except SpecError as error:
        first = error.problems[0]
        return f"at `{placed_effect.place}`: {first.span}: {first.label}"
    return ""
