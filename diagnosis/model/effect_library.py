"""Effect library: descriptions of effects, their places in a spec and the changed lines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from diagnosis.model.placed_effect import (
    PlacedEffect,
    automaton_with_effects,
    find_placements,
    overlay_effects,
    read_effects,
)
from language.overlays.effect_reader import DESCRIPTION_KEYS, Effect, PlacePattern, read_effect
from language.overlays.expand_document import Project
from language.overlays.name_types import format_si_unit
from language.text.diagnostic import DataError, Problems, Source, Span, SpecError
from language.text.document import Document, MappingNode
from language.text.provenance import diff_specs

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
    placed_effects = tuple(one for one in fits if not _placement_error(one, document, project))
    altered = {
        placed_effect.place: tuple(equation_changes(document, [placed_effect]))
        for placed_effect in placed_effects
    }
    return EffectDescription(effect, _defining_lines(effect.body), placed_effects, altered)


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


def load_effects(folder: Path) -> tuple[Effect, ...]:
    """Return the effects of the `*.yaml` files directly in a folder, sorted by file name.

    Raises ValueError without any, and SpecError for an invalid file or a name that is there twice.
    """
    effects = read_effects(folder)
    if not effects:
        raise DataError(f"there is no effect in {folder}")
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
    """Return why an effect at a place that matches makes the automaton invalid, or ""."""
    try:
        automaton_with_effects(document, project, [placed_effect])
    except SpecError as error:
        first = error.problems[0]
        return f"at `{placed_effect.place}`: {first.span}: {first.label}"
    return ""


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
        if one.path.partition(".")[0] in EQUATION_SECTIONS
        and not one.path.endswith((".unit", ".about", ".range", ".initial"))
    ]
