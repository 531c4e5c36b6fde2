"""Hover: what a name or a key means - unit, value, range, text, and who reads it."""

from __future__ import annotations

from pathlib import Path

from lsprotocol import types

from language.constants import exact_value
from language.document import Document, Entry, Scalar, Table
from language.load import load_automaton
from language.problem import Span, SpecError
from language.project import shown
from language.tree import entries
from modewright.editing.guide import places
from modewright.editing.shape import Key, Part, shapes
from modewright.lsp.mention import Mention, mentions, mentions_of
from modewright.lsp.namespace import Declared
from modewright.lsp.positions import holds, range_of
from modewright.lsp.world import World

SHOWN = ("unit", "value", "derived", "default", "initial", "range", "tunable", "type", "of")
"""Keys of a declaration that tell what it is, in this order."""
MOST_READERS = 12


def mention_at(world: World, path: Path, position: types.Position) -> Mention | None:
    """Return what is named at a position; of parts that touch there the last one."""
    found = [each for each in mentions(world, path) if holds(each.span, position, world.encoding)]
    return found[-1] if found else None


def hover(world: World, path: Path, position: types.Position) -> types.Hover | None:
    """Return what is told of the name or key at a position."""
    mention = mention_at(world, path, position)
    if mention:
        return _told(world, _of_name(world, mention.declared), mention.span)
    document = world.document(path)
    found = _key_at(document, position, world.encoding) if document else None
    if found is None:
        return None
    entry, key = found
    return _told(world, f"`{key.name}` - {key.about}", entry.span)


def _told(world: World, text: str, span: Span) -> types.Hover:
    content = types.MarkupContent(types.MarkupKind.Markdown, text)
    return types.Hover(content, range_of(span, world.encoding))


def _key_at(
    document: Document, position: types.Position, encoding: str
) -> tuple[Entry, Key] | None:
    for place in places(document.root):
        if isinstance(place.node, Table) and isinstance(place.kind, Part):
            for entry in place.node:
                keys = shapes()[place.kind.shape].keys
                if entry.key in keys and holds(entry.span, position, encoding):
                    return entry, keys[entry.key]
    return None


def _of_name(world: World, declared: Declared) -> str:
    lines = [f"**{declared.name}** - {declared.kind}, {_place(declared)}", ""]
    node = declared.node.root if isinstance(declared.node, Document) else declared.node
    about = node.get("about") if isinstance(node, Table) else None
    if isinstance(about, Scalar):
        lines += [about.text, ""]
    if isinstance(node, Scalar):
        lines.append(f"- `{node.text}`")
    for entry in entries(node if isinstance(node, Table) else None):
        if entry.key in SHOWN:
            lines.append(f"- {entry.key}: `{_text(entry)}`")
    if isinstance(node, Table) and declared.kind == "parameter" and "derived" in node.entries:
        lines += _computed(world, declared)
    readers = [each for each in mentions_of(world, declared) if not each.is_declaration]
    if readers:
        lines += ["", "read by " + ", ".join(_readers(readers))]
    return "\n".join(lines)


def _place(declared: Declared) -> str:
    return f"{shown(declared.file)}:{declared.span.line}"


def _text(entry: Entry) -> str:
    """Return what is written behind a key, on one line."""
    span = entry.node.span
    if isinstance(entry.node, Scalar):
        return entry.node.text
    lines = span.source.lines
    return lines[span.line - 1][span.column - 1 : span.column - 1 + span.width]


def _computed(world: World, declared: Declared) -> list[str]:
    """The value of a derived parameter, where its automaton can be read."""
    try:
        automaton = load_automaton(str(declared.file), world.project())
        formula = automaton.parameters[declared.name].derived
        if formula is None:
            return []
        value = float(exact_value(formula, automaton))
    except (SpecError, KeyError):
        return []
    return [f"- value: `{value:.6g}` in SI"]


def _readers(readers: list[Mention]) -> list[str]:
    paths = dict.fromkeys(f"`{_owner(each)}{'.'.join(each.path)}`" for each in readers)
    told = list(paths)[:MOST_READERS]
    return told if len(paths) <= MOST_READERS else [*told, f"{len(paths) - MOST_READERS} more"]


def _owner(mention: Mention) -> str:
    """The name of the file, where it is another one than that of the declaration."""
    return "" if mention.is_here else f"{Path(mention.span.source.name).stem} "
