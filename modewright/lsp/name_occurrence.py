"""Name occurrences: find the names in a spec with their places and the sort of thing they
denote.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from language.expressions.parser import parse_balance, parse_expression
from language.expressions.syntax_tree import FunctionCall, Name as Read, Relation, walk
from language.text.diagnostic import Span, SpecError
from language.text.document import Document, Entry, MappingNode, ScalarNode, SequenceNode
from modewright.editing.key_shape import MappingOf, ShapeRef, Value
from modewright.editing.node_kinds import Place, places

FREE_KEY_SECTIONS = (
    *("points", "rows", "columns", "redirect", "steps", "table", "pages", "windows"),
    *("if", "invariant", "expect"),
)
"""Sections whose keys are not names of the spec."""
QUERIED_KINDS = {"in": "asked_mode", "fault": "asked_fault"}
"""Sorts of names that are arguments of these functions."""


@dataclass(frozen=True)
class NameOccurrence:
    """A dotted name with its place, the keys that lead to it, and the sort of thing it denotes.

    `owner` is the instance or region of a mode, if it is stated beside the name.
    """

    text: str
    span: Span
    path: tuple[str, ...]
    kind: str = "value"
    is_key: bool = False
    owner: str | None = None


def find_names(document: Document) -> tuple[NameOccurrence, ...]:
    """Return the names in a document in the order of its nodes, the name of the document first.

    This includes names in keys, in expressions and in references. Nodes of unknown kind and invalid
    expressions give none.
    """
    return tuple(_iter_names(document))


def _iter_names(document: Document) -> Iterator[NameOccurrence]:
    """Yield the names in a document."""
    yield NameOccurrence(document.name, document.name_span, (document.kind,), "spec")
    for place in places(document.root):
        if place.kind == ShapeRef("expectation") and isinstance(place.node, MappingNode):
            yield from _expected_modes(place, place.node)
        elif place.path[:1] == ("expect",) and place.section == "modes":
            continue
        elif isinstance(place.node, ScalarNode):
            yield from _names_in_scalar(place, place.node)
        elif isinstance(place.node, MappingNode) and isinstance(place.kind, MappingOf):
            for entry in place.node:
                yield from _names_in_key(place, entry)


def _expected_modes(place: Place, table: MappingNode) -> Iterator[NameOccurrence]:
    """Yield the modes that a test expects; they belong to the instance `of`."""
    of, modes = table.get("of"), table.get("modes")
    owner = of.text if isinstance(of, ScalarNode) else ""
    for node in modes.nodes if isinstance(modes, SequenceNode) else ():
        if isinstance(node, ScalarNode):
            path = (*place.path, "modes")
            yield NameOccurrence(node.text, node.text_span, path, "mode", owner=owner)


def _names_in_key(place: Place, entry: Entry) -> Iterator[NameOccurrence]:
    """Yield the names in a key of a mapping with free keys."""
    section, path = place.section, (*place.path, entry.key)
    if section == "modes":
        yield NameOccurrence(entry.key, entry.text_span, path, "mode", is_key=True)
    elif section == "transitions":
        to = entry.node.get("to") if isinstance(entry.node, MappingNode) else None
        if to is None:
            yield NameOccurrence(entry.key, entry.text_span, path, "mode", is_key=True)
    elif "transition_table" in place.path:
        of = "mode" if section == "rows" else "column"
        if section in ("rows", "columns") or place.path[-2] == "rows":
            yield NameOccurrence(entry.key, entry.text_span, path, of, is_key=True)
    elif section in ("regions", "templates", "faults", "events"):
        yield NameOccurrence(entry.key, entry.text_span, path, section[:-1], is_key=True)
    elif section == "effects":
        effect, _, at = entry.key.partition("@")
        yield NameOccurrence(effect, entry.text_span.subspan(0, len(effect)), path, "effect")
        yield NameOccurrence(at, entry.text_span.subspan(len(effect) + 1, len(at)), path)
    elif place.path[:1] == ("tables",):
        if len(place.path) == len(("tables", "a name", "rows", "a row")):
            yield NameOccurrence(entry.key, entry.text_span, path, is_key=True)
    elif not any(key in FREE_KEY_SECTIONS for key in place.path):
        yield NameOccurrence(entry.key, entry.text_span, path, is_key=True)


def _names_in_scalar(place: Place, scalar: ScalarNode) -> Iterator[NameOccurrence]:
    """Yield the names in a scalar according to its kind."""
    match place.kind:
        case Value("name", "event"):
            yield from _event_names(place, scalar)
        case Value("expression", _) if "->" in scalar.text:
            yield from _event_names(place, scalar)
        case Value("name", of) if of:
            yield NameOccurrence(scalar.text, scalar.text_span, place.path, of)
        case Value(("expression" | "balance" | "literal") as word, _):
            yield from _names_in_expression(place, scalar, word)


def _event_names(place: Place, scalar: ScalarNode) -> Iterator[NameOccurrence]:
    """Yield the name of an event, or both modes of a transition `a -> b`."""
    offset = 0
    for part in scalar.text.split("->"):
        text = part.strip()
        start = scalar.text.index(text, offset)
        offset = start + len(text)
        yield NameOccurrence(text, scalar.text_span.subspan(start, len(text)), place.path, "event")


def _names_in_expression(place: Place, scalar: ScalarNode, word: str) -> Iterator[NameOccurrence]:
    """Yield the names in an expression; invalid expressions yield none.

    Names beside `==` get the other side as owner; arguments of `in` and `fault` are modes and
    faults. Whether a compared name is a mode is decided when it is resolved.
    """
    try:
        trees = parse_balance(scalar) if word == "balance" else (parse_expression(scalar),)
    except SpecError:
        return
    parts = [part for tree in trees for part in walk(tree)]
    owners: dict[Span, str] = {}
    queried: dict[Span, str] = {}
    for part in parts:
        match part:
            case Relation("==" | "!=", Read() as left, Read() as right, _):
                owners |= {right.span: left.path, left.span: right.path}
            case FunctionCall(("in" | "fault") as function, arguments):
                queried |= dict.fromkeys((each.span for each in arguments), QUERIED_KINDS[function])
    for part in parts:
        if isinstance(part, Read):
            owner = owners.get(part.span)
            of = queried.get(part.span) or ("value" if owner is None else "compared")
            yield NameOccurrence(part.path, part.span, place.path, of, owner=owner)
