"""Name: every name that is written in a spec, with its place and how it is meant."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from language.document import Document, Entry, Scalar, Table
from language.parse import parse_balance, parse_expression
from language.problem import Span, SpecError
from language.syntax import Name as Read, names as names_in
from modewright.editing.guide import Place, places
from modewright.editing.shape import MappingOf, Value

FREE = ("points", "rows", "columns", "redirect", "steps", "table", "pages", "windows")
"""Sections whose keys are no names of the spec."""


@dataclass(frozen=True)
class Name:
    """A dotted name as it is written: where, by which keys, and what it is to name."""

    text: str
    span: Span
    path: tuple[str, ...]
    of: str = "value"
    is_key: bool = False


def names(document: Document) -> tuple[Name, ...]:
    """Return the names that are written in a document, in its order."""
    return tuple(_names(document))


def _names(document: Document) -> Iterator[Name]:
    yield Name(document.name, document.name_span, (document.kind,), "spec")
    for place in places(document.root):
        if isinstance(place.node, Scalar):
            yield from _in_scalar(place, place.node)
        elif isinstance(place.node, Table) and isinstance(place.kind, MappingOf):
            for entry in place.node:
                yield from _in_key(place, entry)


def _in_key(place: Place, entry: Entry) -> Iterator[Name]:
    section, path = place.section, (*place.path, entry.key)
    if section == "modes":
        yield Name(entry.key, entry.span, path, "mode", is_key=True)
    elif section == "transitions":
        to = entry.node.get("to") if isinstance(entry.node, Table) else None
        if to is None:
            yield Name(entry.key, entry.span, path, "mode", is_key=True)
    elif "transition_table" in place.path:
        of = "mode" if section == "rows" else "column"
        if section in ("rows", "columns") or place.path[-2] == "rows":
            yield Name(entry.key, entry.span, path, of, is_key=True)
    elif section in ("regions", "templates", "faults", "events"):
        yield Name(entry.key, entry.span, path, section[:-1], is_key=True)
    elif section == "effects":
        effect, _, at = entry.key.partition("@")
        yield Name(effect, entry.span.inside(0, len(effect)), path, "effect")
        yield Name(at, entry.span.inside(len(effect) + 1, len(at)), path)
    elif not any(key in FREE for key in place.path):
        yield Name(entry.key, entry.span, path, is_key=True)


def _in_scalar(place: Place, scalar: Scalar) -> Iterator[Name]:
    match place.kind:
        case Value("name", "event"):
            offset = 0
            for part in scalar.text.split("->"):
                text = part.strip()
                start = scalar.text.index(text, offset)
                offset = start + len(text)
                yield Name(text, scalar.text_span.inside(start, len(text)), place.path, "event")
        case Value("name", of) if of:
            yield Name(scalar.text, scalar.text_span, place.path, of)
        case Value(("expression" | "balance" | "literal") as word, _):
            for name in _read(scalar, word):
                yield Name(name.path, name.span, place.path)


def _read(scalar: Scalar, word: str) -> list[Read]:
    try:
        trees = parse_balance(scalar) if word == "balance" else (parse_expression(scalar),)
    except SpecError:
        return []
    return [name for tree in trees for name in names_in(tree)]
