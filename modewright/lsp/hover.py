"""Hover: describe the name or key at a position - unit, value, range, text and references."""

from __future__ import annotations

from pathlib import Path

from lsprotocol import types

from language.loading.load import load_automaton
from language.lowering.constants import evaluate_exactly
from language.overlays.expand_document import display_path
from language.text.diagnostic import Span, SpecError
from language.text.document import Document, Entry, MappingNode, ScalarNode
from language.text.node_edit import mapping_entries
from modewright.editing.key_shape import Key, ShapeRef, shapes
from modewright.editing.node_kinds import places
from modewright.lsp.positions import contains_position, range_of
from modewright.lsp.reference import Reference, find_references, references_to
from modewright.lsp.symbol_table import Symbol
from modewright.lsp.workspace import Workspace

SHOWN_KEYS = ("unit", "value", "derived", "default", "initial", "range", "tunable", "type", "of")
"""Keys of a declaration that are shown, in this order."""
MAX_READERS = 12
"""Largest number of references that are listed."""


def reference_at(workspace: Workspace, path: Path, position: types.Position) -> Reference | None:
    """Return the reference that contains a position or ends at it; None if there is none.

    If two parts of a name meet at the position, it is the last one.
    """
    found = [
        each
        for each in find_references(workspace, path)
        if contains_position(each.span, position, workspace.encoding)
    ]
    return found[-1] if found else None


def hover(workspace: Workspace, path: Path, position: types.Position) -> types.Hover | None:
    """Return a description in Markdown of the name or key at a position; None if there is none.

    A name has kind, place, `about`, the keys of SHOWN_KEYS, the value in SI of a derived parameter,
    and up to MAX_READERS places that refer to it; a known key has its description. Names take
    precedence.
    """
    reference = reference_at(workspace, path, position)
    if reference:
        return _make_hover(workspace, _describe_symbol(workspace, reference.symbol), reference.span)
    document = workspace.document(path)
    found = _key_at(document, position, workspace.encoding) if document else None
    if found is None:
        return None
    entry, key = found
    return _make_hover(workspace, f"`{key.name}` - {key.about}", entry.span)


def _make_hover(workspace: Workspace, text: str, span: Span) -> types.Hover:
    """Return Markdown text for a span."""
    content = types.MarkupContent(types.MarkupKind.Markdown, text)
    return types.Hover(content, range_of(span, workspace.encoding))


def _key_at(
    document: Document, position: types.Position, encoding: str
) -> tuple[Entry, Key] | None:
    """Return the entry and the key at a position; None if there is none."""
    for place in places(document.root):
        if isinstance(place.node, MappingNode) and isinstance(place.kind, ShapeRef):
            for entry in place.node:
                keys = shapes()[place.kind.shape].keys
                if entry.key in keys and contains_position(entry.span, position, encoding):
                    return entry, keys[entry.key]
    return None


def _describe_symbol(workspace: Workspace, symbol: Symbol) -> str:
    """Return the description of a symbol in Markdown."""
    lines = [f"**{symbol.name}** - {symbol.kind}, {_format_place(symbol)}", ""]
    node = symbol.node.root if isinstance(symbol.node, Document) else symbol.node
    about = node.get("about") if isinstance(node, MappingNode) else None
    if isinstance(about, ScalarNode):
        lines += [about.text, ""]
    if isinstance(node, ScalarNode):
        lines.append(f"- `{node.text}`")
    for entry in mapping_entries(node if isinstance(node, MappingNode) else None):
        if entry.key in SHOWN_KEYS:
            lines.append(f"- {entry.key}: `{_entry_text(entry)}`")
    if isinstance(node, MappingNode) and symbol.kind == "parameter" and "derived" in node.entries:
        lines += _derived_value_lines(workspace, symbol)
    readers = [each for each in references_to(workspace, symbol) if not each.is_declaration]
    if readers:
        lines += ["", "read by " + ", ".join(_reader_names(readers))]
    return "\n".join(lines)


def _format_place(symbol: Symbol) -> str:
    """Return `file:line` of a declaration."""
    return f"{display_path(symbol.file)}:{symbol.span.line}"


def _entry_text(entry: Entry) -> str:
    """Return the text of a value on one line."""
    span = entry.node.span
    if isinstance(entry.node, ScalarNode):
        return entry.node.text
    lines = span.source.lines
    return lines[span.line - 1][span.column - 1 : span.column - 1 + span.width]


def _derived_value_lines(workspace: Workspace, symbol: Symbol) -> list[str]:
    """Return the line with the value of a derived parameter; empty if it cannot be computed."""
    try:
        automaton = load_automaton(str(symbol.file), workspace.project())
        formula = automaton.parameters[symbol.name].derived
        if formula is None:
            return []
        value = float(evaluate_exactly(formula, automaton))
    except (SpecError, KeyError):
        return []
    return [f"- value: `{value:.6g}` in SI"]


def _reader_names(readers: list[Reference]) -> list[str]:
    """Return the paths of references, limited to MAX_READERS."""
    paths = dict.fromkeys(f"`{_file_prefix(each)}{'.'.join(each.path)}`" for each in readers)
    shown_names = list(paths)[:MAX_READERS]
    return (
        shown_names
        if len(paths) <= MAX_READERS
        else [*shown_names, f"{len(paths) - MAX_READERS} more"]
    )


def _file_prefix(reference: Reference) -> str:
    """Return the name of the file of a reference; empty if it declares the symbol."""
    return "" if reference.is_in_declaring_file else f"{Path(reference.span.source.name).stem} "
