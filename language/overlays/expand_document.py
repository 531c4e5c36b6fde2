"""Expansion of a document: variants, effects and calibrations are applied to their base."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from language.expressions.name_rules import check_document_name
from language.overlays.apply_effect import apply_effect
from language.overlays.calibration import (
    Calibration,
    apply_calibration,
    read_calibration,
    report_unknown_parameter,
    set_instance_value,
)
from language.overlays.effect_reader import read_effect_application
from language.readers.base_reader import Reader
from language.text.diagnostic import Problem, Problems, Source, Span, SpecError
from language.text.document import Document, Entry, MappingNode, ScalarNode, SequenceNode
from language.text.node_edit import mapping_entries
from language.text.overlay import apply_overlay, without_keys
from language.text.project_files import Project, display_path, parse_document, read_document

__all__ = [
    "Project",
    "add_calibrations",
    "apply_variant",
    "display_path",
    "expand_document",
    "lineage",
    "parse_document",
    "read_document",
]

OVERLAY_KEYS = ("effects", "calibrations")
"""Keys of a document that name overlays: effects are applied first, then calibrations."""
OTHER_NAME_RULES = ("automaton", "effect", "calibration")
"""Kinds of documents of which the reader of the kind checks the name."""
MAX_OVERLAYS = 20
"""Largest number of variants in a chain of `extends`."""


def expand_document(
    document: Document, project: Project, problems: Problems | None = None
) -> Document:
    """Return a document with its variants, effects and calibrations applied to the base.

    First those of the base, then each variant from the base on: its body, its effects, its
    calibrations. The result has the kind of the base and the name of the document. A document of
    any kind is accepted; one without overlays is returned unchanged. Warnings are added to
    `problems`. Raises SpecError, also for a wrong name of a system, scenario, map, study or test,
    or of a variant of one of them.
    """
    problems = problems or Problems()
    *variants, base = _extension_chain(document, project)
    if base.kind not in OTHER_NAME_RULES:
        name_problems = Problems()
        for overlay in (base, *variants):
            check_document_name(overlay.name, overlay.name_span, name_problems)
        name_problems.raise_if_errors()
    expanded = _apply_effects_and_calibrations(base, base, project, problems)
    for variant in reversed(variants):
        expanded = _apply_variant_body(expanded, variant, project, problems)
    return expanded


def apply_variant(
    base: Document, variant: Document, project: Project, problems: Problems
) -> Document:
    """Return `base` with `variant` applied, under the name of the base.

    `base` is expanded first. Its kind is that of the result, its source that of the variant. Raises
    SpecError unless `variant` extends the base or a document that the base extends, and for
    problems of the overlays.
    """
    assert variant.kind == "variant"
    base_name = _base_name_of(variant)
    if base_name.text not in lineage(base, project):
        label = f"variant `{variant.name}` extends `{base_name.text}`, not `{base.name}`"
        problems.error("variant", base_name.span, label)
    problems.raise_if_errors()
    expanded = _apply_variant_body(
        expand_document(base, project, problems), variant, project, problems
    )
    head = Entry(expanded.kind, base.name_span, ScalarNode(base.name, base.name_span))
    root = MappingNode({**expanded.root.entries, expanded.kind: head}, expanded.root.span)
    return Document(expanded.kind, base.name, base.name_span, root, variant.source)


def lineage(document: Document, project: Project) -> list[str]:
    """Return the names of a document and of the documents that it extends, the base last.

    Raises SpecError for a missing base, a cycle and a chain of more than MAX_OVERLAYS documents.
    """
    return [overlay.name for overlay in _extension_chain(document, project)]


def _extension_chain(document: Document, project: Project) -> list[Document]:
    """Return a document and the documents that it extends, the base last.

    Raises SpecError for a cycle and for a chain of more than `MAX_OVERLAYS` documents.
    """
    chain = [document]
    while chain[-1].kind == "variant":
        extends = _base_name_of(chain[-1])
        base = project.read(project.path_of(extends.text, extends.span))
        chain.append(base)
        names = [overlay.name for overlay in chain]
        problems = Problems()
        if base.name in names[:-1]:
            cycle = " -> ".join(f"`{name}`" for name in names[names.index(base.name) :])
            label = f"`{base.name}` extends itself: {cycle}"
            problems.error("variant", extends.span, label, "one of them must extend a base")
        elif len(chain) > MAX_OVERLAYS:
            label = f"a chain of `extends` has more than {MAX_OVERLAYS} documents"
            problems.error("variant", extends.span, label)
        problems.raise_if_errors()
    return chain


def _apply_variant_body(
    base: Document, variant: Document, project: Project, problems: Problems
) -> Document:
    """Return an expanded base with the body, effects and calibrations of a variant applied.

    The result has the name of the variant.
    """
    body = without_keys(variant.root, "language", "variant", "extends", *OVERLAY_KEYS)
    root = apply_overlay(base.root, body, problems)
    problems.raise_if_errors()
    name = ScalarNode(variant.name, variant.name_span)
    named = {**root.entries, base.kind: Entry(base.kind, variant.name_span, name)}
    tree = MappingNode(named, variant.root.span)
    merged = Document(base.kind, variant.name, variant.name_span, tree, variant.source)
    return _apply_effects_and_calibrations(merged, variant, project, problems)


def add_calibrations(document: Document, names: Sequence[str], option: str) -> Document:
    """Return a document with the calibrations `names` added after its own; unchanged without names.

    `option` is the command-line option that names them; problems are placed there. They are applied
    when the document is expanded; whether they exist is not checked here.
    """
    node = document.root.get("calibrations")
    own = node.nodes if isinstance(node, SequenceNode) else ()
    span = Span(Source(option, (" ".join(names),)), 1, 1)
    added = tuple(ScalarNode(name, span) for name in names)
    if not added:
        return document
    entry = Entry("calibrations", span, SequenceNode((*own, *added), span))
    root = MappingNode({**document.root.entries, "calibrations": entry}, document.root.span)
    return dataclasses.replace(document, root=root)


def parameters_of(tree: MappingNode, project: Project) -> dict[str, MappingNode]:
    """Return the mappings of the parameters of an automaton's tree and of its model, by name.

    The model is expanded. A parameter of the automaton replaces one of the model with the same
    name. Entries that are no mappings are left out; instances are not searched. Raises SpecError if
    the model cannot be expanded.
    """
    result: dict[str, MappingNode] = {}
    model = tree.get("model")
    if isinstance(model, ScalarNode):
        base = expand_document(project.read(project.path_of(model.text, model.span)), project)
        result = parameters_of(without_keys(base.root, "model"), project)
    for entry in mapping_entries(tree.get("parameters")):
        if isinstance(entry.node, MappingNode):
            result[entry.key] = entry.node
    return result


def instance_parameters_of(tree: MappingNode, project: Project) -> dict[str, tuple[str, str]]:
    """Return the instance and parameter for each parameter of the instances in an automaton's tree.

    The keys are names like `k1_t_close`: instance, underscore, parameter. Instances without `of`
    are left out. Raises SpecError if the document of an instance cannot be expanded.
    """
    result: dict[str, tuple[str, str]] = {}
    for entry in mapping_entries(tree.get("instances")):
        of = entry.node.get("of") if isinstance(entry.node, MappingNode) else None
        if isinstance(of, ScalarNode):
            root = expand_document(project.read(project.path_of(of.text, of.span)), project).root
            names = parameters_of(root, project)
            result.update({f"{entry.key}_{name}": (entry.key, name) for name in names})
    return result


def _apply_effects_and_calibrations(
    merged: Document, overlay: Document, project: Project, problems: Problems
) -> Document:
    """Return a document with the effects, then the calibrations, of one of its overlays.

    `overlay` is the document whose keys name them. Raises SpecError.
    """
    merged = _apply_effects(merged, overlay, project, problems)
    node = overlay.root.get("calibrations")
    if node is None:
        return merged
    root = without_keys(merged.root, "calibrations")
    names = Reader(problems).read_list(node, "calibrations")
    for name in names:
        document = project.read(project.path_of(name.text, name.span))
        calibration = read_calibration(document, problems)
        known = [*lineage(overlay, project), merged.name, *_model_names(root, project)]
        if merged.kind == "automaton" and calibration.of.text in known:
            own, inner = parameters_of(root, project), instance_parameters_of(root, project)
            root = apply_calibration(root, calibration, own, inner, problems)
        elif merged.kind == "system":
            root = _calibrate_system(root, calibration, known, project, problems)
        else:
            _report_wrong_target(calibration, merged.name, name.span, problems)
    problems.raise_if_errors()
    return dataclasses.replace(merged, root=root)


def _model_names(tree: MappingNode, project: Project) -> list[str]:
    """Return the names of the model of an automaton's tree and of the documents that it extends."""
    model = tree.get("model")
    if not isinstance(model, ScalarNode):
        return []
    return lineage(project.read(project.path_of(model.text, model.span)), project)


def _calibrate_system(
    root: MappingNode,
    calibration: Calibration,
    names: list[str],
    project: Project,
    problems: Problems,
) -> MappingNode:
    """Return the tree of a system with the values of a calibration set at its instances.

    A calibration of an automaton sets its parameters at all instances of that automaton. A
    calibration of the system names them `instance.parameter`. Unknown parameters, and a calibration
    of something else, are reported.
    """
    targets: dict[str, tuple[str, str]] = {}
    is_applicable = calibration.of.text in names
    for entry in mapping_entries(root.get("instances")):
        of = entry.node.get("of") if isinstance(entry.node, MappingNode) else None
        if not isinstance(of, ScalarNode):
            continue
        document = project.read(project.path_of(of.text, of.span))
        is_target = calibration.of.text in lineage(document, project)
        is_applicable = is_applicable or is_target
        tree = expand_document(document, project).root
        for name in (*parameters_of(tree, project), *instance_parameters_of(tree, project)):
            targets[name if is_target else f"{entry.key}.{name}"] = (entry.key, name)
            if is_target and name in calibration.values:
                root = set_instance_value(root, (entry.key, name), calibration.values[name].value)
    if not is_applicable:
        _report_wrong_target(calibration, names[0], calibration.of.span, problems)
        return root
    for key, value in calibration.values.items():
        if key not in targets:
            report_unknown_parameter(calibration, value, targets, problems)
        elif "." in key:
            root = set_instance_value(root, targets[key], value.value)
    return root


def _report_wrong_target(
    calibration: Calibration, name: str, span: Span, problems: Problems
) -> None:
    """Report that a calibration is of another automaton or system than `name`."""
    label = f"calibration `{calibration.name}` is of `{calibration.of.text}`, not of `{name}`"
    problems.error("values", span, label)


def _apply_effects(
    merged: Document, overlay: Document, project: Project, problems: Problems
) -> Document:
    """Return a document with the effects of one of its overlays applied in their order.

    Raises SpecError; the problems of all effects are collected first.
    """
    node = overlay.root.get("effects")
    if node is None:
        return merged
    if merged.kind != "automaton" or not isinstance(node, MappingNode):
        label = f"`effects` apply to an automaton; `{merged.name}` is a {merged.kind}"
        if not isinstance(node, MappingNode):
            label = "`effects` is a mapping"
        problems.error("form", overlay.root.entries["effects"].span, label)
        problems.raise_if_errors()
    root = without_keys(merged.root, "effects")
    for entry in mapping_entries(node):
        effect_problems = Problems()
        with effect_problems.collect_errors():
            root = apply_effect(
                root,
                read_effect_application(entry, project.read_effect_document, effect_problems),
                effect_problems,
            )
        problems.reported.extend(effect_problems.reported)
    problems.raise_if_errors()
    return dataclasses.replace(merged, root=root)


def _base_name_of(document: Document) -> ScalarNode:
    """Return the name under `extends`. Raises SpecError if it is missing."""
    node = document.root.get("extends")
    if isinstance(node, ScalarNode):
        return node
    raise SpecError([Problem("form", document.name_span, "a variant names its base in `extends`")])
