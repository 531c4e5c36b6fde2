"""Effects: the library of physics that a diagnosis can name, as functions of the public API."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from diagnosis.model.effect_library import EffectDescription, describe_effect, library_effects
from diagnosis.result.effect_naming import VERDICT_ALIASES
from language.loading.load import automaton_of
from language.overlays.expand_document import Project, expand_document, read_document
from language.text.diagnostic import Problems, Source, Span, SpecError, suggest_name
from language.text.document import Document

if TYPE_CHECKING:
    from engine.results.plot import Picture

DEFAULT_BASE = "blind_driveline"
"""The spec over which signatures are drawn where none is named."""
PREFIX_LENGTH = 4
"""Letters at the start of a word that make two names alike."""


def list_effects(at: str | None = None, root: Path | None = None) -> list[EffectDescription]:
    """Return all effects of the project and of the product; with a spec, the places they fit."""
    project = Project(root or Path())
    document = _load_base(at, project) if at else None
    return [describe_effect(effect, document, project) for effect in library_effects(project)]


def find_effect(name: str, at: str | None = None, root: Path | None = None) -> EffectDescription:
    """Return one effect; with a spec, the places it fits, or the one of `effect@place`.

    Raises SpecError.
    """
    project = Project(root or Path())
    document = _load_base(at, project) if at else None
    known = {one.name: one for one in library_effects(project)}
    effect_name, _, place = name.partition("@")
    effect_name, _ = VERDICT_ALIASES.get(effect_name, (effect_name, ""))
    if effect_name not in known:
        _raise_name_error(
            name, f"there is no effect named `{effect_name}`", _suggest_name(effect_name, known)
        )
    found = describe_effect(known[effect_name], document, project)
    if not place or document is None:
        return found
    layers = tuple(layer for layer in found.placements if layer.place == place)
    if not layers:
        fits = ", ".join(found.places) or "none"
        _raise_name_error(
            name, f"`{effect_name}` fits no `{place}` of `{document.name}`", f"places: {fits}"
        )
    return dataclasses.replace(found, placements=layers)


def _suggest_name(name: str, known: Iterable[str]) -> str:
    """Return what may have been meant: the nearest name, or those that begin a word alike."""
    names = sorted({*known, *VERDICT_ALIASES})
    nearest_name = suggest_name(name, names)
    if nearest_name:
        return nearest_name
    start = name[:PREFIX_LENGTH]
    found = [one for one in names if any(word.startswith(start) for word in one.split("_"))]
    if len(start) == PREFIX_LENGTH and found:
        return f"there are {', '.join(f'`{one}`' for one in found)}"
    return "`modewright effects` lists them"


def _raise_name_error(text: str, label: str, help: str) -> NoReturn:
    problems = Problems()
    span = Span(Source("command line", (text,)), 1, 1, max(1, len(text)))
    problems.error("name", span, label, help)
    raise SpecError(problems.reported)


def draw_signature(
    name: str, at: str | None = None, root: Path | None = None, *, step: str | None = None
) -> Picture:
    """Draw how an effect shows: a spec without and with it, under steps of an input.

    `name` may say where it is laid: `coulomb_friction@w_em`; `step` is like `T_em=40 N*m`.
    Raises SpecError, ValueError.
    """
    from diagnosis.model.effect_signature import draw_signature, simulate_signature as runs

    project = Project(root or Path())
    document = _load_base(at or DEFAULT_BASE, project)
    layers = find_effect(name, at or DEFAULT_BASE, root).placements
    if not layers:
        raise ValueError(f"`{name}` fits no place of `{document.name}`")
    return draw_signature(runs(document, project, layers[0], _parse_step(step) if step else None))


def _parse_step(text: str) -> tuple[str, str]:
    name, _, height = (part.strip() for part in text.partition("="))
    if not (name and height):
        raise ValueError(f"`{text}` is not `input=height`")
    return name, height


def _load_base(reference: str, project: Project) -> Document:
    """Return the expanded automaton of a reference. Raises SpecError."""
    document = expand_document(read_document(project.path_of(reference)), project)
    automaton_of(document, project)
    return document
