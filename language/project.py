"""Project: where specs are found by name, and how a document is read with what it extends."""

from __future__ import annotations

import dataclasses
import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib import resources
from pathlib import Path

from language.document import Document, Entry, Scalar, Table, read_text
from language.effect import read_laying
from language.laying import lay_effect
from language.overlay import lay, without
from language.problem import Problems, Source, Span, SpecError, nearest
from language.tree import entries
from language.yaml_tree import parse

KINDS = ("automaton", "system", "scenario", "map", "variant", "effect")
LATER_KINDS = ("study", "test", "calibration")
HEAD = re.compile(rf"^({'|'.join(KINDS + LATER_KINDS)}):\s*([^\s#]+)", re.MULTILINE)
VERSION = "1"
MAX_LAYERS = 20
"""Most variants laid over each other."""


@dataclass(frozen=True)
class Project:
    """A folder whose `spec/` is searched first, before the specs that are shipped."""

    root: Path
    files: list[Path] = field(default_factory=list, repr=False)

    @cached_property
    def index(self) -> dict[str, list[Path]]:
        """Files by the name of what they hold, those of the project first.

        An effect is called like physics; what else has its name goes before it.
        """
        return {**self.effects, **self._named(lambda kind: kind != "effect")}

    @cached_property
    def effects(self) -> dict[str, list[Path]]:
        """Files of effects by name, those of the project first."""
        return self._named(lambda kind: kind == "effect")

    def _named(self, wanted: Callable[[str], bool]) -> dict[str, list[Path]]:
        own: dict[str, list[Path]] = {}
        for path in _yaml_files(self.root / "spec"):
            for kind, name in _heads_in(path):
                if wanted(kind):
                    own.setdefault(name, []).append(path)
        shipped = Path(str(resources.files("spec")))
        if shipped.resolve() != (self.root / "spec").resolve():
            for path in _yaml_files(shipped):
                for kind, name in _heads_in(path):
                    if wanted(kind):
                        own.setdefault(name, [path])
        return own

    def effect(self, name: str, span: Span) -> Document:
        """Return the document of an effect. Raises SpecError."""
        return read_document(self._one_of(self.effects, name, span, "effect"))

    def path_of(self, reference: str, span: Span | None = None) -> Path:
        """Return the file of a name or path. Raises SpecError for none or several."""
        if reference.endswith((".yaml", ".yml")) or os.sep in reference:
            base = Path(span.source.name).parent if span else Path()
            beside = base / reference
            return beside if beside.exists() else Path(reference)
        place = span or Span(Source("command line", (reference,)), 1, 1, len(reference))
        return self._one_of(self.index, reference, place, "spec")

    def _one_of(
        self, index: Mapping[str, list[Path]], reference: str, place: Span, what: str
    ) -> Path:
        found = index.get(reference, [])
        if len(found) == 1:
            return found[0]
        problems = Problems()
        if found:
            files = ", ".join(shown(path) for path in found)
            problems.error("name", place, f"`{reference}` is defined twice", f"in {files}")
        else:
            hint = nearest(reference, index)
            if what == "spec":
                hint = nearest(reference, index) or "a name of a spec below spec/, or a path"
            problems.error("name", place, f"there is no {what} named `{reference}`", hint)
        raise SpecError(problems.found)


def shown(path: Path) -> str:
    """Return a path as it is shown: relative to the working directory where that is shorter."""
    try:
        relative = os.path.relpath(path)
    except ValueError:
        return str(path)
    return relative if not relative.startswith("..") else str(path)


def read_document(path: Path) -> Document:
    """Read one file and its head. Raises SpecError."""
    source, text = read_text(path, shown(path))
    return document_of(source, text)


def document_of(source: Source, text: str) -> Document:
    """Return the document of a text: `language: 1`, then one kind and its name."""
    root = parse(source, text)
    problems = Problems()
    _check_version(root, problems)
    heads = [entry for entry in root if entry.key in KINDS + LATER_KINDS]
    if not heads:
        first = next(iter(root), None)
        span = first.span if first else root.span
        label = "the file does not say what it holds"
        problems.error("form", span, label, f"one of the keys {', '.join(KINDS)} with a name")
    elif len(heads) > 1:
        label = f"one file holds one thing: `{heads[0].key}` is given too"
        problems.error("form", heads[1].span, label)
    elif heads[0].key in LATER_KINDS:
        label = f"`{heads[0].key}` files are not read by this version"
        problems.error("form", heads[0].span, label)
    elif not isinstance(heads[0].node, Scalar):
        problems.error("form", heads[0].span, f"`{heads[0].key}` is followed by a name")
    problems.stop_if_any()
    head = heads[0]
    assert isinstance(head.node, Scalar)
    return Document(head.key, head.node.text, head.node.span, root, source)


def expanded(document: Document, project: Project, problems: Problems | None = None) -> Document:
    """Return a variant laid over its base, as a document of the base's kind.

    Warnings are left in `problems`. Raises SpecError.
    """
    problems = problems or Problems()
    *variants, base = _layers(document, project)
    made = _with_effects(base, base, project, problems)
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
        base = read_document(project.path_of(extends.text, extends.span))
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
    body = without(over.root, "language", "variant", "extends", "effects")
    root = lay(base.root, body, problems)
    problems.stop_if_any()
    name = Scalar(over.name, over.name_span)
    named = {**root.entries, base.kind: Entry(base.kind, over.name_span, name)}
    tree = Table(named, over.root.span)
    made = Document(base.kind, over.name, over.name_span, tree, over.source)
    return _with_effects(made, over, project, problems)


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


def _check_version(root: Table, problems: Problems) -> None:
    first = next(iter(root), None)
    node = root.get("language")
    if node is None:
        span = first.span if first else root.span
        problems.error(
            "version", span, "`language: 1` is missing", "it is the first line of a spec"
        )
    elif not isinstance(node, Scalar) or node.text != VERSION:
        problems.error("version", node.span, "this version of the language is not known: use 1")


def _yaml_files(folder: Path) -> Iterator[Path]:
    if folder.is_dir():
        yield from sorted(folder.rglob("*.yaml"))


def _heads_in(path: Path) -> list[tuple[str, str]]:
    try:
        text = path.read_text("utf-8", errors="replace")[:65536]
    except OSError:
        return []
    return [(match.group(1), match.group(2).strip("'\"")) for match in HEAD.finditer(text)]
