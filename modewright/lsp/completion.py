"""Completion: propose keys, names, words and units at a position of an incomplete text."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from lsprotocol import types

from language.expressions.unit_symbols import SYMBOLS
from language.text.diagnostic import SpecError
from language.text.document import Document, MappingNode, ScalarNode, SequenceNode, YamlNode
from language.text.project_files import DOCUMENT_KINDS, parse_document, source_of
from language.typecheck.function_calls import FUNCTION_NAMES
from modewright.editing.key_shape import (
    Choice,
    MappingOf,
    ShapeRef,
    Value,
    ValueKind,
    alternatives_of,
    shapes,
)
from modewright.editing.node_kinds import Place, kind_of_file, places, root_shape
from modewright.lsp.expected_symbols import expected_symbols
from modewright.lsp.positions import column_of, encoded_column
from modewright.lsp.symbol_table import Symbol, SymbolTable, build_symbol_table
from modewright.lsp.workspace import Workspace

CURSOR_MARK = "zzCURSORzz"
"""Replaces the word at the cursor; no name of a spec contains it."""
CLOSING_OF = {"{": "}", "[": "]"}
"""The closing bracket of each opening one."""
COMPOUND_UNITS = (
    *("N*m", "rad/s", "rad/s^2", "kg*m^2", "N*m/rad", "N*m*s/rad", "m/s", "m/s^2", "km/h"),
    *("N/m", "N*s/m", "1/s", "rad^2/s"),
)
"""Frequent compound units."""
WRITABLE_KINDS = ("state", "discrete variable")
"""Kinds of symbols that actions can assign."""
NAME_GROUPS = {
    "mode": ("mode",),
    "template": ("template",),
    "fault": ("fault",),
    "event": ("event", "mode"),
}
"""Groups of symbols to which names of each target belong."""
SPEC_KINDS = {
    "automaton": ("automaton", "variant"),
    "system": ("system", "automaton", "variant"),
    "scenario": ("scenario", "variant"),
    "map": ("map", "variant"),
    "calibration": ("calibration",),
    "spec": DOCUMENT_KINDS,
}
"""Kinds of files to which names of specs may refer."""
Item = types.CompletionItem
K = types.CompletionItemKind


def complete(workspace: Workspace, path: Path, text: str, position: types.Position) -> list[Item]:
    """Return the completions at a position, independent of the part of the word already written.

    The editor filters them by this part. These are keys, or values by the kind that is expected
    there; restricted places, such as after `mode ==`, give the fitting names only. A dotted name is
    replaced as a whole. Where the text cannot be completed to valid YAML or the kind of the file is
    unknown, the heads of files are returned.
    """
    marked_document = _insert_mark(path, text, position, workspace.encoding)
    if marked_document is None:
        return _root_items()
    document, before = marked_document
    symbols = build_symbol_table(workspace, path, document)
    marked_place = _marked_place(document)
    if marked_place is None:
        return _root_items()
    place, is_key = marked_place
    candidates = (
        _key_items(symbols, place) if is_key else _value_items(workspace, symbols, place, before)
    )
    items = {item.label: item for item in candidates if CURSOR_MARK not in item.label}
    dotted_range = _dotted_name_range(text, position, workspace.encoding)
    return [_replace_range(item, dotted_range) if dotted_range else item for item in items.values()]


def _value_items(
    workspace: Workspace, symbols: SymbolTable, place: Place, before: str
) -> Iterator[Item]:
    """Yield the completions of a value: the expected symbols if they are restricted, else all."""
    expected = None if _is_after_number(before) else expected_symbols(symbols, place, before)
    if expected is not None:
        for name, each in expected:
            is_word = each.group == "value" and not name.endswith(each.name)
            word = Item(name, kind=K.EnumMember, detail=f"word of {each.name}")
            yield word if is_word else _symbol_item(each, name)
        return
    for kind in alternatives_of(place.kind):
        yield from _kind_items(workspace, symbols, kind, before)


def _dotted_name_range(text: str, position: types.Position, encoding: str) -> types.Range | None:
    """Return the range of a dotted name at the cursor; None for names without dot.

    Editors regard its last part as the word.
    """
    at, line, start, column = _word_at(text, position, encoding)
    if "." not in line[start:column]:
        return None
    ends = (encoded_column(line, count, encoding) for count in (start, column))
    return types.Range(*(types.Position(at, end) for end in ends))


def _replace_range(item: Item, place: types.Range) -> Item:
    """Return an item that replaces a range as a whole."""
    item.text_edit = types.TextEdit(place, item.insert_text or item.label)
    return item


def _root_items() -> list[Item]:
    """Return the completions of an empty file: `language` and the kinds of files."""
    heads = [
        Item(kind, kind=K.Class, documentation=shapes()[kind].about) for kind in DOCUMENT_KINDS
    ]
    return [Item("language", kind=K.Keyword, insert_text="language: 1"), *heads]


def _insert_mark(
    path: Path, text: str, position: types.Position, encoding: str
) -> tuple[Document, str] | None:
    """Return the document with a mark in place of the word, and the text before it.

    Return None on failure. Incomplete text is seldom valid YAML, so missing colons and brackets are
    tried.
    """
    lines = [*(text.splitlines() or [""]), ""]
    at, line, start, column = _word_at(text, position, encoding)
    end = column + len(re.match(r"\w*", line[column:]).group())  # type: ignore[union-attr]
    before, after = line[:start], line[end:]
    closing = _closing_brackets(before)
    for tail in (after, f": {after}", closing, f": {closing}"):
        lines[at] = f"{before}{CURSOR_MARK}{tail}"
        marked_text = "\n".join(lines) + "\n"
        try:
            return parse_document(source_of(path, marked_text), marked_text), before
        except SpecError:
            continue
    return None


def _word_at(text: str, position: types.Position, encoding: str) -> tuple[int, str, int, int]:
    """Return line number, line, and start and end column of the word before a position."""
    lines = [*(text.splitlines() or [""]), ""]
    at = min(position.line, len(lines) - 1)
    column = column_of(lines[at], position, encoding)
    written = re.search(r"[\w$.]*$", lines[at][:column])
    assert written
    return at, lines[at], column - len(written.group()), column


def _closing_brackets(text: str) -> str:
    """Return the quotes and brackets that close those open at the end of a text."""
    opened: list[str] = []
    quote = ""
    for character in text:
        if quote:
            quote = "" if character == quote else quote
        elif character in "\"'":
            quote = character
        elif character in CLOSING_OF:
            opened.append(CLOSING_OF[character])
        elif opened and character == opened[-1]:
            opened.pop()
    return quote + "".join(reversed(opened))


def _marked_place(document: Document) -> tuple[Place, bool] | None:
    """Return the place of the mark, and whether it stands for a key there; None if not found."""
    for place in places(document.root):
        match place.node, place.kind:
            case MappingNode() as node, _ if any(CURSOR_MARK in key for key in node.entries):
                return place, True
            case ScalarNode(text), (ShapeRef() | MappingOf()) if CURSOR_MARK in text:
                return place, True
            case ScalarNode(text), _ if CURSOR_MARK in text:
                return place, False
            case SequenceNode() as items, _ if _holds_mark(items) and not isinstance(
                place.kind, ShapeRef
            ):
                continue
    return None


def _holds_mark(items: SequenceNode) -> bool:
    """Return whether a list contains the mark."""
    return any(isinstance(node, ScalarNode) and CURSOR_MARK in node.text for node in items.nodes)


def _key_items(symbols: SymbolTable, place: Place) -> Iterator[Item]:
    """Yield the keys that may be added to a mapping."""
    present: set[str] = set(place.node.entries) if isinstance(place.node, MappingNode) else set()
    for kind in alternatives_of(place.kind):
        if isinstance(kind, ShapeRef):
            shape = shapes()[kind.shape]
            if not place.path and isinstance(place.node, MappingNode):
                shape = root_shape(kind_of_file(place.node)) or shape
            for key in shape.keys.values():
                if key.name not in present:
                    yield Item(
                        key.name,
                        kind=K.Property,
                        detail=_describe_kind(key.kind),
                        documentation=key.about,
                        insert_text=f"{key.name}: ",
                    )
        elif isinstance(kind, MappingOf):
            yield from _free_key_items(symbols, place, present)


def _free_key_items(symbols: SymbolTable, place: Place, present: set[str]) -> Iterator[Item]:
    """Yield the existing names that may be keys of a mapping.

    By section these are targets, states, assigned variables or inputs of instances.
    """
    section = place.section
    if section == "transitions":
        items = [
            _symbol_item(each, each.name.rpartition(".")[2]) for each in symbols.in_groups("mode")
        ]
    elif section in ("reset", "entry", "exit", "update", "flow"):
        kinds = WRITABLE_KINDS if section != "flow" else ("state",)
        items = [_symbol_item(each) for each in symbols.in_groups("value") if each.kind in kinds]
    elif section == "connections":
        items = list(_instance_items(symbols, ("input",)))
    elif section in ("initial", "vary", "set", "values", "parameters", "inputs", "pages"):
        items = list(_expression_items(_instance_symbols(symbols, place)))
    else:
        items = []
    yield from (item for item in items if item.label not in present)


def _instance_symbols(symbols: SymbolTable, place: Place) -> SymbolTable:
    """Return the symbols of the instance whose values are set; else all symbols."""
    if place.section == "values" and len(place.path) > 1:
        return symbols.instances.get(place.path[-2], symbols)
    return symbols


def _kind_items(
    workspace: Workspace, symbols: SymbolTable, kind: ValueKind, before: str
) -> Iterator[Item]:
    """Yield the completions of a kind of value."""
    match kind:
        case Choice(words):
            yield from (Item(word, kind=K.EnumMember) for word in words)
        case Value("truth"):
            yield from (Item(word, kind=K.Keyword) for word in ("true", "false"))
        case Value("unit"):
            yield from _unit_items()
        case Value("name", of) if of in SPEC_KINDS:
            yield from _spec_items(workspace, SPEC_KINDS[of])
        case Value("name", "model_mode") if symbols.model:
            model = symbols.model
            for each in model.in_groups("mode"):
                yield _symbol_item(each, f"{model.document.name}.{each.name}")
        case Value("name", of) if of in NAME_GROUPS:
            yield from (
                _symbol_item(each, each.name) for each in symbols.in_groups(*NAME_GROUPS[of])
            )
        case Value(("expression" | "balance" | "literal" | "name"), _):
            if _is_after_number(before):
                yield from _unit_items()
                return
            yield from _expression_items(symbols)
            if kind != Value("literal"):
                yield from (Item(f, kind=K.Function, insert_text=f"{f}(") for f in FUNCTION_NAMES)


def _is_after_number(before: str) -> bool:
    """Return whether the text ends with a number and a blank, so that a unit follows."""
    return re.search(r"(^|[^\w.])\d[\d.]*(e[-+]?\d+)? $", before) is not None


def _expression_items(symbols: SymbolTable) -> Iterator[Item]:
    """Yield the names that an expression may contain."""
    yield from (_symbol_item(each) for each in symbols.in_groups("value"))
    yield from _instance_items(symbols, ())


def _instance_items(symbols: SymbolTable, kinds: tuple[str, ...]) -> Iterator[Item]:
    """Yield the symbols of instances with their prefixes, optionally of some kinds only."""
    for name, inner in symbols.instances.items():
        for each in inner.in_groups("value"):
            if not kinds or each.kind in kinds:
                yield _symbol_item(each, f"{name}.{each.name}")


def _symbol_item(symbol: Symbol, label: str = "") -> Item:
    """Return the completion of a symbol with unit and description."""
    node = symbol.node
    unit: YamlNode | None = node.get("unit") if isinstance(node, MappingNode) else None
    detail = f"{symbol.kind} [{unit.text}]" if isinstance(unit, ScalarNode) else symbol.kind
    about = node.get("about") if isinstance(node, MappingNode) else None
    text = about.text if isinstance(about, ScalarNode) else None
    kind = K.Variable if symbol.group == "value" else K.Class
    return Item(label or symbol.name, kind=kind, detail=detail, documentation=text)


def _unit_items() -> Iterator[Item]:
    """Yield the units."""
    return (Item(unit, kind=K.Unit) for unit in dict.fromkeys((*COMPOUND_UNITS, *SYMBOLS)))


def _spec_items(workspace: Workspace, kinds: tuple[str, ...]) -> Iterator[Item]:
    """Yield the specs of the project of some kinds, except effects."""
    project = workspace.project()
    for name, files in sorted(project.index.items()):
        document = workspace.document(files[0])
        if document and document.kind in kinds and document.kind != "effect":
            yield Item(name, kind=K.File, detail=document.kind)


def _describe_kind(kind: ValueKind) -> str:
    """Return a short description of a kind of value."""
    texts = []
    for each in alternatives_of(kind):
        match each:
            case Value(word, of):
                texts.append(of or word)
            case Choice(words):
                texts.append(" | ".join(words))
            case ShapeRef(shape):
                texts.append(shape.replace("_", " "))
            case MappingOf():
                texts.append("mapping")
            case _:
                texts.append("list")
    return " or ".join(texts)
