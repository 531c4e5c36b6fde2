"""Effects: list, describe and draw the effects that a diagnosis can find."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import TYPE_CHECKING, NoReturn

from diagnosis.model.effect_library import EffectDescription, describe_effect, library_effects
from diagnosis.result.verdict import VERDICT_ALIASES
from language.loading.load import automaton_of
from language.overlays.expand_document import Project, expand_document, read_document
from language.text.arguments import PathText, optional, to_project, to_text
from language.text.diagnostic import Problem, Source, Span, SpecError, suggest_name
from language.text.document import Document

if TYPE_CHECKING:
    from engine.results.plot import Picture

DEFAULT_BASE = "blind_driveline"
"""The spec for drawings of effects if none is named."""
PREFIX_LENGTH = 4
"""Number of common first letters for which two names are considered similar."""


def list_effects(
    at: PathText | None = None, root: PathText | None = None
) -> list[EffectDescription]:
    """Return descriptions of all effects of the project and of the library.

    With a spec `at` each has the places where it fits in that spec, else none. Raises SpecError,
    also if `at` is no valid automaton.
    """
    project, base = to_project(root), optional(to_text, at, "at")
    document = _load_base(base, project) if base else None
    return [describe_effect(effect, document, project) for effect in library_effects(project)]


def find_effect(
    name: str, at: PathText | None = None, root: PathText | None = None
) -> EffectDescription:
    """Return the description of one effect; with a spec `at`, also its places in that spec.

    `name` may be `effect@place`: with `at` only this place is returned, without `at` the place is
    ignored. Old names of effects (VERDICT_ALIASES) are accepted. Raises SpecError for an unknown
    name, with similar names as help, and for a place where the effect does not fit.
    """
    project, base, name = to_project(root), optional(to_text, at, "at"), to_text(name, "name")
    document = _load_base(base, project) if base else None
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
    """Return a hint: the most similar name, else names with a word that begins equally."""
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
    """Raise SpecError for a text of the command line."""
    span = Span(Source("command line", (text,)), 1, 1, max(1, len(text)))
    raise SpecError([Problem("name", span, label, help)])


def draw_signature(
    name: str, at: PathText | None = None, root: PathText | None = None, *, step: str | None = None
) -> Picture:
    """Draw the response of a spec to steps of an input, without and with an effect.

    `name` may contain the place: `coulomb_friction@w_em`; else the first place is taken. `at` is
    the spec (default: DEFAULT_BASE). `step` is `input=height`, such as `T_em=40 N*m`; by default it
    is the input at the place of the effect, else the first input without a default. Raises
    SpecError, and ValueError if the effect fits no place, the step is malformed or there is no such
    input.
    """
    from diagnosis.model.effect_signature import draw_signature, simulate_signature

    project, base = to_project(root), optional(to_text, at, "at") or DEFAULT_BASE
    step = optional(to_text, step, "step")
    document = _load_base(base, project)
    layers = find_effect(name, base, root).placements
    if not layers:
        raise ValueError(f"`{name}` fits no place of `{document.name}`")
    parsed_step = _parse_step(step) if step else None
    return draw_signature(simulate_signature(document, project, layers[0], parsed_step))


def _parse_step(text: str) -> tuple[str, str]:
    """Return input and height of a step `input=height`. Raises ValueError."""
    name, _, height = (part.strip() for part in text.partition("="))
    if not (name and height):
        raise ValueError(f"`{text}` is not `input=height`")
    return name, height


def _load_base(reference: str, project: Project) -> Document:
    """Return the expanded document of an automaton that is valid. Raises SpecError."""
    document = expand_document(read_document(project.path_of(reference)), project)
    automaton_of(document, project)
    return document
