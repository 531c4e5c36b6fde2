"""Own effects: those of a folder that a diagnosis tries in place of those shipped."""

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
    """Return the effects of a folder, each of a name of its own. Raises SpecError, ValueError."""
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
    """Yield, for each effect that no place of an expanded automaton takes, why it is not tried."""
    for effect in effects:
        layers = find_placements(document, effect)
        refusals = [_placement_error(layer, document, project) for layer in layers]
        if all(refusals):
            why = next(iter(refusals), f"it fits no place of `{document.name}`")
            yield f"effect `{effect.name}` is not tried: {why}"


def _placement_error(layer: PlacedEffect, document: Document, project: Project) -> str:
    """Return why an effect cannot be laid at a place that it fits; nothing where it can."""
    try:
        automaton_with_effects(document, project, [layer])
    except SpecError as error:
        first = error.problems[0]
        return f"at `{layer.place}`: {first.span}: {first.label}"
    return ""
