"""Effect library: descriptions of effects, their places in a spec and the changed lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from diagnosis.model.equation_change import EquationChange, equation_changes
from diagnosis.model.placed_effect import PlacedEffect, automaton_with_effects, find_placements
from language.overlays.effect_reader import DESCRIPTION_KEYS, Effect, PlacePattern, read_effect
from language.overlays.expand_document import Project
from language.overlays.name_types import format_si_unit
from language.text.diagnostic import Problems, Source, Span, SpecError
from language.text.document import Document, MappingNode

HEADER_KEYS = ("language", "effect", "about", "at", *DESCRIPTION_KEYS)
"""Keys of an effect file that describe it; the other keys define its equations."""


@dataclass(frozen=True)
class EffectDescription:
    """An effect, its defining lines, its places in a spec and the `changes` at each of them."""

    effect: Effect
    lines: tuple[str, ...] = field(repr=False)
    placements: tuple[PlacedEffect, ...] = field(default=(), repr=False)
    changes: Mapping[str, tuple[EquationChange, ...]] = field(default_factory=dict, repr=False)

    @property
    def places(self) -> tuple[str, ...]:
        """The names of the places where the effect can be applied."""
        return tuple(placed_effect.place for placed_effect in self.placements)


def library_effects(project: Project) -> tuple[Effect, ...]:
    """Return all effects of a project by name; SpecError with the problems of all files."""
    span = Span(Source("effects"), 1, 1)
    problems = Problems()
    found = [
        read_effect(project.read_effect_document(name, span), problems)
        for name in sorted(project.effect_index)
    ]
    problems.raise_if_errors()
    return tuple(found)


def describe_effect(
    effect: Effect, document: Document | None = None, project: Project | None = None
) -> EffectDescription:
    """Return the description of an effect, with its valid places in a given document."""
    if document is None or project is None:
        return EffectDescription(effect, _defining_lines(effect.body))
    fits = find_placements(document, effect)
    placed_effects = tuple(
        placed_effect for placed_effect in fits if _is_placeable(document, project, placed_effect)
    )
    altered = {
        placed_effect.place: tuple(equation_changes(document, [placed_effect]))
        for placed_effect in placed_effects
    }
    return EffectDescription(effect, _defining_lines(effect.body), placed_effects, altered)


def _is_placeable(document: Document, project: Project, placed_effect: PlacedEffect) -> bool:
    """Return whether the automaton with the effect is valid; a place matches by structure only."""
    try:
        automaton_with_effects(document, project, (placed_effect,))
    except SpecError:
        return False
    return True


def _defining_lines(body: MappingNode) -> tuple[str, ...]:
    """Return the lines of an effect file under keys other than `HEADER_KEYS`, in file order."""
    source = body.span.source
    starts = sorted((entry.span.line, entry.key) for entry in body)
    ends = [line for line, _ in starts[1:]] + [len(source.lines) + 1]
    found: list[str] = []
    for (line, key), end in zip(starts, ends, strict=True):
        if key not in HEADER_KEYS:
            found += source.lines[line - 1 : end - 1]
    return tuple(found)


def format_place_kinds(effect: Effect) -> str:
    """Return in words the kinds of place to which an effect applies, joined by ", or "."""
    return ", or ".join(_format_place_kind(fit) for fit in effect.place_patterns)


def _format_place_kind(fit: PlacePattern) -> str:
    """Return in words one kind of place, with its unit and required keys."""
    if fit.kind == "balance":
        words = "the balance of a speed" if fit.of == "rate" else "a balance"
    elif fit.kind == "element":
        words = f"an {fit.of} element" if fit.of == "elastic" else "an inertia"
    else:
        words = f"an {fit.kind}"
    unit = f" in {format_si_unit(fit.unit)}" if fit.unit else ""
    has = f" that has {', '.join(fit.has)}" if fit.has else ""
    return words + unit + has
