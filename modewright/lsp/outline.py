"""Outline: list the declarations of a spec by section, with nested modes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from lsprotocol import types

from language.text.diagnostic import Span
from language.text.document import Entry, MappingNode, SequenceNode, YamlNode
from modewright.editing.key_shape import MappingOf
from modewright.editing.node_kinds import places
from modewright.lsp.positions import range_of
from modewright.lsp.workspace import Workspace

K = types.SymbolKind
SECTION_KINDS = {
    "parameters": K.Constant,
    "inputs": K.Variable,
    "states": K.Variable,
    "discrete": K.Variable,
    "equations": K.Variable,
    "sensors": K.Variable,
    "outputs": K.Interface,
    "events": K.Event,
    "faults": K.Event,
    "instances": K.Object,
    "modes": K.Class,
    "regions": K.Namespace,
    "templates": K.Class,
    "transitions": K.Method,
    "tables": K.Array,
    "effects": K.Object,
    "connections": K.Interface,
    "expect": K.Boolean,
    "measures": K.Variable,
    "vary": K.Variable,
}
"""Sections whose keys are listed, with the kind of symbol."""
KeyPath = tuple[str, ...]


def outline(workspace: Workspace, path: Path) -> list[types.DocumentSymbol]:
    """Return the symbol of the document with sections and declarations as children.

    Only keys in sections of SECTION_KINDS are listed; a declaration is a child of the nearest
    listed one that encloses it. Empty if the file was never valid YAML.
    """
    document = workspace.document(path)
    if document is None:
        return []
    root = document.root
    symbols: dict[KeyPath, types.DocumentSymbol] = {
        (): _document_symbol(document.name, K.File, document.name_span, root, workspace.encoding)
    }
    symbols[()].detail = document.kind
    symbols[()].range.start = types.Position(0, 0)
    for place in places(root):
        if not isinstance(place.node, MappingNode) or not isinstance(place.kind, MappingOf):
            continue
        kind = SECTION_KINDS.get(place.section)
        if kind is None:
            continue
        if len(place.path) == 1:
            _add_symbol(
                symbols, place.path, root.entries[place.section], K.Package, workspace.encoding
            )
        for entry in place.node:
            _add_symbol(symbols, (*place.path, entry.key), entry, kind, workspace.encoding)
    return [symbols[()]]


def _add_symbol(
    symbols: dict[KeyPath, types.DocumentSymbol],
    path: KeyPath,
    entry: Entry,
    kind: types.SymbolKind,
    encoding: str,
) -> None:
    """Add a symbol as a child of the nearest enclosing symbol."""
    outer = next(path[:count] for count in range(len(path) - 1, -1, -1) if path[:count] in symbols)
    symbols[path] = _document_symbol(entry.key, kind, entry.span, entry.node, encoding)
    inner = symbols[outer].children
    symbols[outer].children = [*(inner or ()), symbols[path]]


def _document_symbol(
    name: str, kind: types.SymbolKind, span: Span, node: YamlNode, encoding: str
) -> types.DocumentSymbol:
    """Return a symbol whose range covers its key and all of its value."""
    own = range_of(span, encoding)
    last = max(_spans(node), key=lambda each: (each.line, each.column + each.width))
    end = max(own.end, range_of(last, encoding).end)
    return types.DocumentSymbol(name or "?", kind, types.Range(own.start, end), own)


def _spans(node: YamlNode) -> Iterator[Span]:
    """Yield the spans of all keys and values of a node."""
    yield node.span
    match node:
        case MappingNode():
            for entry in node:
                yield entry.span
                yield from _spans(entry.node)
        case SequenceNode():
            for part in node.nodes:
                yield from _spans(part)
