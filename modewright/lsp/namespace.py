"""Namespace: what names mean in a spec, with those of its base, its model, its instances."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from language.document import Document, Entry, Scalar, Table
from language.model import CHART
from language.problem import Span
from language.tree import entries
from modewright.editing.guide import places
from modewright.editing.shape import MappingOf
from modewright.lsp.world import World, text_at

VALUES = {
    "parameters": "parameter",
    "inputs": "input",
    "states": "state",
    "discrete": "discrete variable",
    "equations": "equation",
    "sensors": "sensor",
    "instances": "instance",
    "outputs": "output",
    "measures": "measure",
    "vary": "what varies",
}
"""Sections that declare what expressions read, and what each declares."""
OTHERS = {
    "modes": "mode",
    "regions": "region",
    "templates": "template",
    "faults": "fault",
    "events": "event",
}
MOST_LAYERS = 20


@dataclass(frozen=True)
class Declared:
    """Something that has a name: where it is declared and what as.

    `group` is `value`, `mode`, `region`, `template`, `fault`, `event`, `column` or `spec`;
    a mode and a region have their path as their name.
    """

    file: Path
    group: str
    name: str
    kind: str
    span: Span
    node: object = field(compare=False, repr=False, default=None)

    @property
    def identity(self) -> tuple[Path, str, str]:
        """What two mentions of one thing have in common."""
        return self.file, self.group, self.name


@dataclass
class Namespace:
    """The names of one spec, by group and name; those of its base and model are the same things."""

    file: Path
    document: Document
    names: dict[tuple[str, str], Declared] = field(default_factory=dict)
    instances: dict[str, Namespace] = field(default_factory=dict)
    model: Namespace | None = None
    of: Namespace | None = None

    @property
    def is_automaton(self) -> bool:
        """Whether this is an automaton, or a variant of one."""
        return ("spec", "automaton") in {(each.group, each.kind) for each in self.names.values()}

    def group(self, *groups: str) -> list[Declared]:
        """Return what is declared in some groups."""
        return [each for (group, _), each in self.names.items() if group in groups]


def namespace(world: World, path: Path, depth: int = 0) -> Namespace | None:
    """Return the names of a spec; None where it cannot be read."""
    document = world.document(path)
    if document is None or depth > MOST_LAYERS:
        return None
    return namespace_of(world, path, document, depth)


def namespace_of(world: World, path: Path, document: Document, depth: int = 0) -> Namespace:
    """Return the names of a document; `depth` counts what it was reached through."""
    made = Namespace(path.resolve(), document)
    base = _other(world, made, "extends", depth)
    if base:
        made.names.update(base.names)
        made.instances.update(base.instances)
        made.model, made.of = base.model, base.of
    model = _other(world, made, "model", depth)
    if model:
        made.model = model
        shared = ("parameter", "state", "input")
        for each in model.group("value"):
            if each.kind in shared:
                made.names[each.group, each.name] = each
    target = _other(world, made, "of", depth) or _tested(world, made, depth)
    if target:
        made.of = target
        made.names.update(target.names)
        made.instances.update(target.instances)
        if target.is_automaton:  # it runs alone, and is an instance of its own name
            made.instances[target.document.name] = target
    if document.kind == "study":  # a bare name is that of all instances that have it
        for inner in made.instances.values():
            for each in inner.group("value"):
                if each.kind == "parameter":
                    made.names.setdefault((each.group, each.name), each)
    for declared in _declared(made.file, document):
        made.names.setdefault((declared.group, declared.name), declared)
    _add_instances(world, made, depth)
    return made


def _tested(world: World, space: Namespace, depth: int) -> Namespace | None:
    """Return what the scenario of a test is of: one that is named, or written in the test."""
    if space.document.kind != "test":
        return None
    written = space.document.root.get("scenario")
    if isinstance(written, Table):
        of = written.get("of")
        path = world.find(of.text, space.file) if isinstance(of, Scalar) else None
        return namespace(world, path, depth + 1) if path else None
    scenario = _other(world, space, "scenario", depth)
    return scenario.of if scenario else None


def _other(world: World, space: Namespace, key: str, depth: int) -> Namespace | None:
    name = text_at(space.document, key)
    path = world.find(name, space.file) if name else None
    return namespace(world, path, depth + 1) if path else None


def _add_instances(world: World, space: Namespace, depth: int) -> None:
    for entry in entries(space.document.root.get("instances")):
        of = entry.node.get("of") if isinstance(entry.node, Table) else None
        path = world.find(of.text, space.file) if isinstance(of, Scalar) else None
        inner = namespace(world, path, depth + 1) if path else None
        if inner:
            space.instances[entry.key] = inner


def _declared(file: Path, document: Document) -> Iterator[Declared]:
    yield Declared(file, "spec", document.name, document.kind, document.name_span, document)
    is_calibration = document.kind in ("calibration", "scenario")
    for place in places(document.root):
        if not isinstance(place.node, Table) or not isinstance(place.kind, MappingOf):
            continue
        for entry in place.node:
            made = None if is_calibration else _one(file, place.path, entry)
            if made:
                yield made


def _one(file: Path, path: tuple[str, ...], entry: Entry) -> Declared | None:
    section = path[-1] if path else ""
    if entry.key.startswith("$"):
        return None
    is_inner = "observer" in path or "redirect" in path
    is_value = len(path) == 1 or section == "equations"
    if section in VALUES and not is_inner and is_value:
        word = VALUES[section]
        return Declared(file, "value", entry.key, word, entry.text_span, entry.node)
    if section == "columns" and "transition_table" in path:
        name = column_name(path, entry.key)
        return Declared(file, "column", name, "column of a table", entry.text_span, entry.node)
    if section in OTHERS:
        word = OTHERS[section]
        name = _name(word, path, entry.key)
        return Declared(file, word, name, word, entry.text_span, entry.node)
    return None


def _name(word: str, path: tuple[str, ...], key: str) -> str:
    if word == "mode" or (word == "region" and key != CHART):
        return mode_path((*path, key))
    return key


def mode_path(path: tuple[str, ...]) -> str:
    """Return the path of a mode: `gap`, in a region `tyre.upper`, nested `drive.creep`.

    `path` are the keys that lead to it; what is below the mode is left out.
    """
    found: list[str] = []
    k = 0
    while k + 1 < len(path) and path[k] in ("modes", "regions"):
        if not (path[k] == "regions" and path[k + 1] == CHART):
            found.append(path[k + 1])
        k += 2
    return ".".join(found)


def column_name(path: tuple[str, ...], key: str) -> str:
    """Return the name of a column with the place of its table: others may have one like it."""
    return f"{mode_path(path)}.{key}"
