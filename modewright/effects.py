"""Effects: the library of physics that a diagnosis can name, as functions of the public API."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from diagnosis.library import Described, described, library
from diagnosis.naming import OTHER_NAMES
from language.document import Document
from language.load import automaton_of
from language.problem import Problems, Source, Span, SpecError, nearest
from language.project import Project, expanded, read_document

if TYPE_CHECKING:
    from engine.plot import Picture

USUAL_BASE = "blind_driveline"
"""The spec over which signatures are drawn where none is named."""
ALIKE = 4
"""Letters at the start of a word that make two names alike."""


def effects(at: str | None = None, root: Path | None = None) -> list[Described]:
    """Return all effects of the project and of the product; with a spec, the places they fit."""
    project = Project(root or Path())
    document = _base(at, project) if at else None
    return [described(effect, document, project) for effect in library(project)]


def effect(name: str, at: str | None = None, root: Path | None = None) -> Described:
    """Return one effect; with a spec, the places it fits, or the one of `effect@place`.

    Raises SpecError.
    """
    project = Project(root or Path())
    document = _base(at, project) if at else None
    known = {one.name: one for one in library(project)}
    plain, _, place = name.partition("@")
    plain, _ = OTHER_NAMES.get(plain, (plain, ""))
    if plain not in known:
        _refuse(name, f"there is no effect named `{plain}`", _like(plain, known))
    found = described(known[plain], document, project)
    if not place or document is None:
        return found
    layers = tuple(layer for layer in found.layers if layer.place == place)
    if not layers:
        fits = ", ".join(found.places) or "none"
        _refuse(name, f"`{plain}` fits no `{place}` of `{document.name}`", f"places: {fits}")
    return dataclasses.replace(found, layers=layers)


def _like(name: str, known: Iterable[str]) -> str:
    """Return what may have been meant: the nearest name, or those that begin a word alike."""
    names = sorted({*known, *OTHER_NAMES})
    near = nearest(name, names)
    if near:
        return near
    start = name[:ALIKE]
    found = [one for one in names if any(word.startswith(start) for word in one.split("_"))]
    if len(start) == ALIKE and found:
        return f"there are {', '.join(f'`{one}`' for one in found)}"
    return "`modewright effects` lists them"


def _refuse(text: str, label: str, help: str) -> NoReturn:
    problems = Problems()
    span = Span(Source("command line", (text,)), 1, 1, max(1, len(text)))
    problems.error("name", span, label, help)
    raise SpecError(problems.found)


def signature(
    name: str, at: str | None = None, root: Path | None = None, *, step: str | None = None
) -> Picture:
    """Draw how an effect shows: a spec without and with it, under steps of an input.

    `name` may say where it is laid: `coulomb_friction@w_em`; `step` is like `T_em=40 N*m`.
    Raises SpecError, ValueError.
    """
    from diagnosis.signature import signature as runs, signature_picture

    project = Project(root or Path())
    document = _base(at or USUAL_BASE, project)
    layers = effect(name, at or USUAL_BASE, root).layers
    if not layers:
        raise ValueError(f"`{name}` fits no place of `{document.name}`")
    return signature_picture(runs(document, project, layers[0], _step(step) if step else None))


def _step(text: str) -> tuple[str, str]:
    name, _, height = (part.strip() for part in text.partition("="))
    if not (name and height):
        raise ValueError(f"`{text}` is not `input=height`")
    return name, height


def _base(reference: str, project: Project) -> Document:
    """Return the expanded automaton of a reference. Raises SpecError."""
    document = expanded(read_document(project.path_of(reference)), project)
    automaton_of(document, project)
    return document
