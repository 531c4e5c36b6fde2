"""Outline: what a spec declares, section by section, modes with what is inside them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from lsprotocol import types

from language.document import Entry, Items, Node, Table
from language.problem import Span
from modewright.editing.guide import places
from modewright.editing.shape import MappingOf
from modewright.lsp.positions import range_of
from modewright.lsp.world import World

K = types.SymbolKind
KINDS = {
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
"""Sections whose keys are shown, and as what an editor draws them."""
Keys = tuple[str, ...]


def outline(world: World, path: Path) -> list[types.DocumentSymbol]:
    """Return the spec with its sections, and in these what they declare."""
    document = world.document(path)
    if document is None:
        return []
    whole = document.root
    found: dict[Keys, types.DocumentSymbol] = {
        (): _symbol(document.name, K.File, document.name_span, whole, world.encoding)
    }
    found[()].detail = document.kind
    found[()].range.start = types.Position(0, 0)
    for place in places(whole):
        if not isinstance(place.node, Table) or not isinstance(place.kind, MappingOf):
            continue
        kind = KINDS.get(place.section)
        if kind is None:
            continue
        if len(place.path) == 1:
            _add(found, place.path, whole.entries[place.section], K.Package, world.encoding)
        for entry in place.node:
            _add(found, (*place.path, entry.key), entry, kind, world.encoding)
    return [found[()]]


def _add(
    found: dict[Keys, types.DocumentSymbol],
    path: Keys,
    entry: Entry,
    kind: types.SymbolKind,
    encoding: str,
) -> None:
    """Add a thing to the nearest that holds it."""
    outer = next(path[:count] for count in range(len(path) - 1, -1, -1) if path[:count] in found)
    found[path] = _symbol(entry.key, kind, entry.span, entry.node, encoding)
    inner = found[outer].children
    found[outer].children = [*(inner or ()), found[path]]


def _symbol(
    name: str, kind: types.SymbolKind, span: Span, node: Node, encoding: str
) -> types.DocumentSymbol:
    own = range_of(span, encoding)
    last = max(_spans(node), key=lambda each: (each.line, each.column + each.width))
    end = max(own.end, range_of(last, encoding).end)
    return types.DocumentSymbol(name or "?", kind, types.Range(own.start, end), own)


def _spans(node: Node) -> Iterator[Span]:
    """Yield the places of all keys and values of a node."""
    yield node.span
    match node:
        case Table():
            for entry in node:
                yield entry.span
                yield from _spans(entry.node)
        case Items():
            for part in node.nodes:
                yield from _spans(part)
