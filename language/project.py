"""Project: a document with what it extends: variants, effects and calibrations laid over a base."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from language.calibration import (
    Calibration,
    calibrated,
    given_to,
    read_calibration,
    report_unknown,
)
from language.document import Document, Entry, Items, Scalar, Table
from language.effect import read_laying
from language.finding import Project, document_of, read_document, shown
from language.laying import lay_effect
from language.overlay import lay, without
from language.problem import Problems, Source, Span, SpecError
from language.reader import Reader
from language.tree import entries

__all__ = [
    "Project",
    "document_of",
    "expanded",
    "layered",
    "lineage",
    "read_document",
    "shown",
    "with_calibrations",
]

LAYER_KEYS = ("effects", "calibrations")
"""What a layer asks for beside its body: effects first, then calibrations."""
MAX_LAYERS = 20
"""Most variants laid over each other."""


def expanded(document: Document, project: Project, problems: Problems | None = None) -> Document:
    """Return a variant laid over its base, as a document of the base's kind.

    Warnings are left in `problems`. Raises SpecError.
    """
    problems = problems or Problems()
    *variants, base = _layers(document, project)
    made = _finished(base, base, project, problems)
    for variant in reversed(variants):
        made = _laid(made, variant, project, problems)
    return made


def layered(base: Document, over: Document, project: Project, problems: Problems) -> Document:
    """Return `base` with the variant `over` laid over it, under the name of the base.

    The variant must extend the base or something that the base was made from.
    """
    assert over.kind == "variant"
    wanted = _extends(over)
    if wanted.text not in lineage(base, project):
        label = f"variant `{over.name}` extends `{wanted.text}`, not `{base.name}`"
        problems.error("variant", wanted.span, label)
    problems.stop_if_any()
    made = _laid(expanded(base, project, problems), over, project, problems)
    head = Entry(made.kind, base.name_span, Scalar(base.name, base.name_span))
    root = Table({**made.root.entries, made.kind: head}, made.root.span)
    return Document(made.kind, base.name, base.name_span, root, over.source)


def lineage(document: Document, project: Project) -> list[str]:
    """Return the names of a document and of everything that it extends."""
    return [layer.name for layer in _layers(document, project)]


def _layers(document: Document, project: Project) -> list[Document]:
    """Return a document and all that it extends, the base last. Raises SpecError for a circle."""
    found = [document]
    while found[-1].kind == "variant":
        extends = _extends(found[-1])
        base = project.read(project.path_of(extends.text, extends.span))
        found.append(base)
        names = [layer.name for layer in found]
        problems = Problems()
        if base.name in names[:-1]:
            circle = " -> ".join(f"`{name}`" for name in names[names.index(base.name) :])
            label = f"`{base.name}` extends itself: {circle}"
            problems.error("variant", extends.span, label, "one of them extends a base")
        elif len(found) > MAX_LAYERS:
            label = f"more than {MAX_LAYERS} layers lie over each other"
            problems.error("variant", extends.span, label)
        problems.stop_if_any()
    return found


def _laid(base: Document, over: Document, project: Project, problems: Problems) -> Document:
    """Return a variant with its effects laid over its expanded base, with the variant's name."""
    body = without(over.root, "language", "variant", "extends", *LAYER_KEYS)
    root = lay(base.root, body, problems)
    problems.stop_if_any()
    name = Scalar(over.name, over.name_span)
    named = {**root.entries, base.kind: Entry(base.kind, over.name_span, name)}
    tree = Table(named, over.root.span)
    made = Document(base.kind, over.name, over.name_span, tree, over.source)
    return _finished(made, over, project, problems)


def with_calibrations(document: Document, names: Sequence[str], option: str) -> Document:
    """Return a document that is calibrated further, as an option of a command asks for it."""
    node = document.root.get("calibrations")
    own = node.nodes if isinstance(node, Items) else ()
    span = Span(Source(option, (" ".join(names),)), 1, 1)
    more = tuple(Scalar(name, span) for name in names)
    if not more:
        return document
    entry = Entry("calibrations", span, Items((*own, *more), span))
    root = Table({**document.root.entries, "calibrations": entry}, document.root.span)
    return dataclasses.replace(document, root=root)


def parameters_of(tree: Table, project: Project) -> dict[str, Table]:
    """Return the parameters of an automaton's tree, those of its model too."""
    found: dict[str, Table] = {}
    model = tree.get("model")
    if isinstance(model, Scalar):
        base = expanded(project.read(project.path_of(model.text, model.span)), project)
        found = parameters_of(without(base.root, "model"), project)
    for entry in entries(tree.get("parameters")):
        if isinstance(entry.node, Table):
            found[entry.key] = entry.node
    return found


def inner_of(tree: Table, project: Project) -> dict[str, tuple[str, str]]:
    """Return instance and parameter of the instances in an automaton's tree, by `k1_t_close`."""
    found: dict[str, tuple[str, str]] = {}
    for entry in entries(tree.get("instances")):
        of = entry.node.get("of") if isinstance(entry.node, Table) else None
        if isinstance(of, Scalar):
            root = expanded(project.read(project.path_of(of.text, of.span)), project).root
            names = parameters_of(root, project)
            found.update({f"{entry.key}_{name}": (entry.key, name) for name in names})
    return found


def _finished(made: Document, layer: Document, project: Project, problems: Problems) -> Document:
    """Return a document with the effects, then the calibrations, of one of its layers."""
    made = _with_effects(made, layer, project, problems)
    node = layer.root.get("calibrations")
    if node is None:
        return made
    root = without(made.root, "calibrations")
    names = Reader(problems).items(node, "calibrations")
    for name in names:
        document = project.read(project.path_of(name.text, name.span))
        calibration = read_calibration(document, problems)
        known = [*lineage(layer, project), made.name, *_models(root, project)]
        if made.kind == "automaton" and calibration.of.text in known:
            own, inner = parameters_of(root, project), inner_of(root, project)
            root = calibrated(root, calibration, own, inner, problems)
        elif made.kind == "system":
            root = _calibrated_system(root, calibration, known, project, problems)
        else:
            _report_not_of(calibration, made.name, name.span, problems)
    problems.stop_if_any()
    return dataclasses.replace(made, root=root)


def _models(tree: Table, project: Project) -> list[str]:
    """Return the names of the model of a sampled automaton's tree and of what that extends."""
    model = tree.get("model")
    if not isinstance(model, Scalar):
        return []
    return lineage(project.read(project.path_of(model.text, model.span)), project)


def _calibrated_system(
    root: Table, calibration: Calibration, names: list[str], project: Project, problems: Problems
) -> Table:
    """Give the values to the instances of what the calibration is of; or by `instance.name`."""
    found: dict[str, tuple[str, str]] = {}
    fits = calibration.of.text in names
    for entry in entries(root.get("instances")):
        of = entry.node.get("of") if isinstance(entry.node, Table) else None
        if not isinstance(of, Scalar):
            continue
        document = project.read(project.path_of(of.text, of.span))
        mine = calibration.of.text in lineage(document, project)
        fits = fits or mine
        tree = expanded(document, project).root
        for name in (*parameters_of(tree, project), *inner_of(tree, project)):
            found[name if mine else f"{entry.key}.{name}"] = (entry.key, name)
            if mine and name in calibration.values:
                root = given_to(root, (entry.key, name), calibration.values[name].value)
    if not fits:
        _report_not_of(calibration, names[0], calibration.of.span, problems)
        return root
    for key, given in calibration.values.items():
        if key not in found:
            report_unknown(calibration, given, found, problems)
        elif "." in key:
            root = given_to(root, found[key], given.value)
    return root


def _report_not_of(calibration: Calibration, name: str, span: Span, problems: Problems) -> None:
    label = f"calibration `{calibration.name}` is of `{calibration.of.text}`, not of `{name}`"
    problems.error("values", span, label)


def _with_effects(
    made: Document, layer: Document, project: Project, problems: Problems
) -> Document:
    """Return a document with the effects of one of its layers laid in their order."""
    node = layer.root.get("effects")
    if node is None:
        return made
    if made.kind != "automaton" or not isinstance(node, Table):
        label = f"`effects` are laid over an automaton; `{made.name}` is a {made.kind}"
        if not isinstance(node, Table):
            label = "`effects` is a mapping"
        problems.error("form", layer.root.entries["effects"].span, label)
        problems.stop_if_any()
    root = without(made.root, "effects")
    for entry in entries(node):
        found = Problems()
        with found.collecting():
            root = lay_effect(root, read_laying(entry, project.effect, found), found)
        problems.found.extend(found.found)
    problems.stop_if_any()
    return dataclasses.replace(made, root=root)


def _extends(document: Document) -> Scalar:
    node = document.root.get("extends")
    if isinstance(node, Scalar):
        return node
    problems = Problems()
    problems.error("form", document.name_span, "a variant says what it `extends`")
    raise SpecError(problems.found)
