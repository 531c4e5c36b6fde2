"""Effects: the library of physics that a diagnosis can name, as functions of the public API."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from diagnosis.library import Described, described, library
from language.document import Document
from language.problem import Problems, Source, Span, nearest
from language.project import Project, expanded, read_document

if TYPE_CHECKING:
    from engine.plot import Picture

USUAL_BASE = "blind_driveline"
"""The spec over which signatures are drawn where none is named."""


def effects(at: str | None = None, root: Path | None = None) -> list[Described]:
    """Return all effects of the project and of the product; with a spec, the places they fit."""
    project = Project(root or Path())
    document = _base(at, project) if at else None
    return [described(effect, document, project) for effect in library(project)]


def effect(name: str, at: str | None = None, root: Path | None = None) -> Described:
    """Return one effect; with a spec, the places it fits. Raises SpecError."""
    project = Project(root or Path())
    document = _base(at, project) if at else None
    known = {one.name: one for one in library(project)}
    if name in known:
        return described(known[name], document, project)
    problems = Problems()
    span = Span(Source("command line", (name,)), 1, 1, max(1, len(name)))
    hint = nearest(name, known) or "`modewright effects` lists them"
    problems.error("name", span, f"there is no effect named `{name}`", hint)
    problems.stop_if_any()
    raise AssertionError(name)


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
    plain, _, place = name.partition("@")
    found = effect(plain, at or USUAL_BASE, root)
    layers = [layer for layer in found.layers if place in ("", layer.place)]
    if not layers:
        fits = ", ".join(found.places) or "none"
        raise ValueError(f"`{name}` fits no place of `{document.name}`; places: {fits}")
    return signature_picture(runs(document, project, layers[0], _step(step) if step else None))


def _step(text: str) -> tuple[str, str]:
    name, _, height = (part.strip() for part in text.partition("="))
    if not (name and height):
        raise ValueError(f"`{text}` is not `input=height`")
    return name, height


def _base(reference: str, project: Project) -> Document:
    return expanded(read_document(project.path_of(reference)), project)
