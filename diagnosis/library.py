"""Library: effects as a reader sees them - what they are, where they fit, how they look."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from diagnosis.change import Change, changes
from diagnosis.layers import Layer, automaton, fitting
from language.document import Document, Table
from language.effect import TEXT_KEYS, Effect, Fit, read_effect
from language.known import unit_text
from language.problem import Problems, Source, Span, SpecError
from language.project import Project

HEAD = ("language", "effect", "about", "at", *TEXT_KEYS)
"""Keys of an effect's file that are told in words."""


@dataclass(frozen=True)
class Described:
    """An effect with its lines of equations, and the places of a spec that it fits.

    `changes` are the lines of the spec that it alters at each place, by the place's name.
    """

    effect: Effect
    lines: tuple[str, ...] = field(repr=False)
    layers: tuple[Layer, ...] = field(default=(), repr=False)
    changes: Mapping[str, tuple[Change, ...]] = field(default_factory=dict, repr=False)

    @property
    def places(self) -> tuple[str, ...]:
        """The names of the places that it fits."""
        return tuple(layer.place for layer in self.layers)


def library(project: Project) -> tuple[Effect, ...]:
    """Return the effects of a project and those shipped, by name. Raises SpecError."""
    span = Span(Source("effects"), 1, 1)
    problems = Problems()
    found = [read_effect(project.effect(name, span), problems) for name in sorted(project.effects)]
    problems.stop_if_any()
    return tuple(found)


def described(
    effect: Effect, document: Document | None = None, project: Project | None = None
) -> Described:
    """Return an effect as it is told, with its places in an expanded document of a project."""
    if document is None or project is None:
        return Described(effect, _lines(effect.body))
    fits = fitting(document, effect)
    layers = tuple(layer for layer in fits if _can_be_laid(document, project, layer))
    altered = {layer.place: tuple(changes(document, [layer])) for layer in layers}
    return Described(effect, _lines(effect.body), layers, altered)


def _can_be_laid(document: Document, project: Project, layer: Layer) -> bool:
    """Tell whether what comes out is sound: a filter's balance looks like one of a speed."""
    try:
        automaton(document, project, (layer,))
    except SpecError:
        return False
    return True


def _lines(body: Table) -> tuple[str, ...]:
    """Return the lines of an effect's file that say what it does."""
    source = body.span.source
    starts = sorted((entry.span.line, entry.key) for entry in body)
    ends = [line for line, _ in starts[1:]] + [len(source.lines) + 1]
    found: list[str] = []
    for (line, key), end in zip(starts, ends, strict=True):
        if key not in HEAD:
            found += source.lines[line - 1 : end - 1]
    return tuple(found)


def place_kinds(effect: Effect) -> str:
    """Return in words what an effect is laid on."""
    return ", or ".join(_kind(fit) for fit in effect.fits)


def _kind(fit: Fit) -> str:
    if fit.kind == "balance":
        words = "the balance of a speed" if fit.of == "rate" else "a balance"
    elif fit.kind == "element":
        words = f"an {fit.of} element" if fit.of == "elastic" else "an inertia"
    else:
        words = f"an {fit.kind}"
    unit = f" in {unit_text(fit.unit)}" if fit.unit else ""
    has = f" that has {', '.join(fit.has)}" if fit.has else ""
    return words + unit + has
