"""Completion: the keys, names, words and units that fit at a place of a text being written."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from lsprotocol import types

from language.document import Document, Items, Node, Scalar, Table
from language.finding import KINDS, document_of, source_of
from language.function import KNOWN
from language.problem import SpecError
from language.symbols import SYMBOLS
from modewright.editing.guide import Place, kind_of_file, places, root_shape
from modewright.editing.shape import Choice, Kind, MappingOf, Part, Value, kinds_in, shapes
from modewright.lsp.asked import asked
from modewright.lsp.namespace import Declared, Namespace, namespace_of
from modewright.lsp.positions import column_of, units_of
from modewright.lsp.world import World

MARK = "zzCURSORzz"
"""Stands in the text for what is being written; no name of a spec looks like it."""
OPENED = {"{": "}", "[": "]"}
COMBINED = (
    *("N*m", "rad/s", "rad/s^2", "kg*m^2", "N*m/rad", "N*m*s/rad", "m/s", "m/s^2", "km/h"),
    *("N/m", "N*s/m", "1/s", "rad^2/s"),
)
"""Combined units that are often needed; others are put together from symbols."""
WRITABLE = ("state", "discrete variable")
GROUPS = {
    "mode": ("mode",),
    "template": ("template",),
    "fault": ("fault",),
    "event": ("event", "mode"),
}
SPEC_KINDS = {
    "automaton": ("automaton", "variant"),
    "system": ("system", "automaton", "variant"),
    "scenario": ("scenario", "variant"),
    "map": ("map", "variant"),
    "calibration": ("calibration",),
    "spec": KINDS,
}
Item = types.CompletionItem
K = types.CompletionItemKind


def complete(world: World, path: Path, text: str, position: types.Position) -> list[Item]:
    """Return what may be written at a position, whatever stands before it of the word."""
    found = _marked(path, text, position, world.encoding)
    if found is None:
        return _heads()
    document, before = found
    space = namespace_of(world, path, document)
    marked = _place(document)
    if marked is None:
        return _heads()
    place, is_key = marked
    found_here = _keys(space, place) if is_key else _at(world, space, place, before)
    items = {item.label: item for item in found_here if MARK not in item.label}
    dotted = _dotted(text, position, world.encoding)
    return [_instead(item, dotted) if dotted else item for item in items.values()]


def _at(world: World, space: Namespace, place: Place, before: str) -> Iterator[Item]:
    """What a value may be: what alone fits, where one thing is asked for, else all it may read."""
    alone = None if _is_after_number(before) else asked(space, place, before)
    if alone is not None:
        for name, each in alone:
            is_word = each.group == "value" and not name.endswith(each.name)
            word = Item(name, kind=K.EnumMember, detail=f"word of {each.name}")
            yield word if is_word else _item(each, name)
        return
    for kind in kinds_in(place.kind):
        yield from _values(world, space, kind, before)


def _dotted(text: str, position: types.Position, encoding: str) -> types.Range | None:
    """Return the place of a dotted name that is being written: editors see its last part alone."""
    at, line, start, column = _word(text, position, encoding)
    if "." not in line[start:column]:
        return None
    ends = (units_of(line, count, encoding) for count in (start, column))
    return types.Range(*(types.Position(at, end) for end in ends))


def _instead(item: Item, place: types.Range) -> Item:
    """Return an item that takes a place as a whole."""
    item.text_edit = types.TextEdit(place, item.insert_text or item.label)
    return item


def _heads() -> list[Item]:
    heads = [Item(kind, kind=K.Class, documentation=shapes()[kind].about) for kind in KINDS]
    return [Item("language", kind=K.Keyword, insert_text="language: 1"), *heads]


def _marked(
    path: Path, text: str, position: types.Position, encoding: str
) -> tuple[Document, str] | None:
    """Return the document with a mark in place of the word at a position, and what is before it.

    What is being written is seldom YAML: a colon, or the ends of brackets, may be missing.
    """
    lines = [*(text.splitlines() or [""]), ""]
    at, line, start, column = _word(text, position, encoding)
    end = column + len(re.match(r"\w*", line[column:]).group())  # type: ignore[union-attr]
    before, after = line[:start], line[end:]
    closing = _closing(before)
    for tail in (after, f": {after}", closing, f": {closing}"):
        lines[at] = f"{before}{MARK}{tail}"
        whole = "\n".join(lines) + "\n"
        try:
            return document_of(source_of(path, whole), whole), before
        except SpecError:
            continue
    return None


def _word(text: str, position: types.Position, encoding: str) -> tuple[int, str, int, int]:
    """Return the number of a line, its text, and from where to where a word is written there."""
    lines = [*(text.splitlines() or [""]), ""]
    at = min(position.line, len(lines) - 1)
    column = column_of(lines[at], position, encoding)
    written = re.search(r"[\w$.]*$", lines[at][:column])
    assert written
    return at, lines[at], column - len(written.group()), column


def _closing(text: str) -> str:
    """Return the brackets that end what is open at the end of a line."""
    opened: list[str] = []
    quote = ""
    for character in text:
        if quote:
            quote = "" if character == quote else quote
        elif character in "\"'":
            quote = character
        elif character in OPENED:
            opened.append(OPENED[character])
        elif opened and character == opened[-1]:
            opened.pop()
    return quote + "".join(reversed(opened))


def _place(document: Document) -> tuple[Place, bool] | None:
    """Return the place of the mark, and whether it stands for a key of that place."""
    for place in places(document.root):
        match place.node, place.kind:
            case Table() as node, _ if any(MARK in key for key in node.entries):
                return place, True
            case Scalar(text), (Part() | MappingOf()) if MARK in text:
                return place, True
            case Scalar(text), _ if MARK in text:
                return place, False
            case Items() as items, _ if _holds_mark(items) and not isinstance(place.kind, Part):
                continue
    return None


def _holds_mark(items: Items) -> bool:
    return any(isinstance(node, Scalar) and MARK in node.text for node in items.nodes)


def _keys(space: Namespace, place: Place) -> Iterator[Item]:
    present: set[str] = set(place.node.entries) if isinstance(place.node, Table) else set()
    for kind in kinds_in(place.kind):
        if isinstance(kind, Part):
            shape = shapes()[kind.shape]
            if not place.path and isinstance(place.node, Table):
                shape = root_shape(kind_of_file(place.node)) or shape
            for key in shape.keys.values():
                if key.name not in present:
                    yield Item(
                        key.name,
                        kind=K.Property,
                        detail=_said(key.kind),
                        documentation=key.about,
                        insert_text=f"{key.name}: ",
                    )
        elif isinstance(kind, MappingOf):
            yield from _named(space, place, present)


def _named(space: Namespace, place: Place, present: set[str]) -> Iterator[Item]:
    """What the keys of a mapping may be: targets, balanced states, what is written."""
    section = place.section
    if section == "transitions":
        found = [_item(each, each.name.rpartition(".")[2]) for each in space.group("mode")]
    elif section in ("reset", "entry", "exit", "update", "flow"):
        wanted = WRITABLE if section != "flow" else ("state",)
        found = [_item(each) for each in space.group("value") if each.kind in wanted]
    elif section == "connections":
        found = list(_of_instances(space, ("input",)))
    elif section in ("initial", "vary", "set", "values", "parameters", "inputs", "pages"):
        found = list(_scope(_inside(space, place)))
    else:
        found = []
    yield from (item for item in found if item.label not in present)


def _inside(space: Namespace, place: Place) -> Namespace:
    if place.section == "values" and len(place.path) > 1:
        return space.instances.get(place.path[-2], space)
    return space


def _values(world: World, space: Namespace, kind: Kind, before: str) -> Iterator[Item]:
    match kind:
        case Choice(words):
            yield from (Item(word, kind=K.EnumMember) for word in words)
        case Value("truth"):
            yield from (Item(word, kind=K.Keyword) for word in ("true", "false"))
        case Value("unit"):
            yield from _units()
        case Value("name", of) if of in SPEC_KINDS:
            yield from _specs(world, SPEC_KINDS[of])
        case Value("name", "model_mode") if space.model:
            model = space.model
            for each in model.group("mode"):
                yield _item(each, f"{model.document.name}.{each.name}")
        case Value("name", of) if of in GROUPS:
            yield from (_item(each, each.name) for each in space.group(*GROUPS[of]))
        case Value(("expression" | "balance" | "literal" | "name"), _):
            if _is_after_number(before):
                yield from _units()
                return
            yield from _scope(space)
            if kind != Value("literal"):
                yield from (Item(f, kind=K.Function, insert_text=f"{f}(") for f in KNOWN)


def _is_after_number(before: str) -> bool:
    return re.search(r"(^|[^\w.])\d[\d.]*(e[-+]?\d+)? $", before) is not None


def _scope(space: Namespace) -> Iterator[Item]:
    """What an expression may read."""
    yield from (_item(each) for each in space.group("value"))
    yield from _of_instances(space, ())


def _of_instances(space: Namespace, kinds: tuple[str, ...]) -> Iterator[Item]:
    for name, inner in space.instances.items():
        for each in inner.group("value"):
            if not kinds or each.kind in kinds:
                yield _item(each, f"{name}.{each.name}")


def _item(declared: Declared, label: str = "") -> Item:
    node = declared.node
    unit: Node | None = node.get("unit") if isinstance(node, Table) else None
    detail = f"{declared.kind} [{unit.text}]" if isinstance(unit, Scalar) else declared.kind
    about = node.get("about") if isinstance(node, Table) else None
    text = about.text if isinstance(about, Scalar) else None
    kind = K.Variable if declared.group == "value" else K.Class
    return Item(label or declared.name, kind=kind, detail=detail, documentation=text)


def _units() -> Iterator[Item]:
    return (Item(unit, kind=K.Unit) for unit in dict.fromkeys((*COMBINED, *SYMBOLS)))


def _specs(world: World, kinds: tuple[str, ...]) -> Iterator[Item]:
    project = world.project()
    for name, files in sorted(project.index.items()):
        document = world.document(files[0])
        if document and document.kind in kinds and document.kind != "effect":
            yield Item(name, kind=K.File, detail=document.kind)


def _said(kind: Kind) -> str:
    """Return what a key holds, in a few words."""
    told = []
    for each in kinds_in(kind):
        match each:
            case Value(word, of):
                told.append(of or word)
            case Choice(words):
                told.append(" | ".join(words))
            case Part(shape):
                told.append(shape.replace("_", " "))
            case MappingOf():
                told.append("mapping")
            case _:
                told.append("list")
    return " or ".join(told)
