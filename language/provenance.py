"""Provenance: every value of an expanded spec with the places and layers that it came from."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from language.document import Items, Node, Scalar, Table
from language.problem import Source, Span

HEAD = re.compile(r"^(automaton|system|scenario|map|variant|effect|study|test|calibration): *(\S+)")
PLAIN = re.compile(
    r"[A-Za-z0-9$(.][A-Za-z0-9_ .+*/^()<>=@$-]*|-[0-9(A-Za-z][A-Za-z0-9_ .+*/^()<>=@$-]*"
)
"""Texts that YAML and we read alike without quotes."""
COLUMN = 64
"""Where the places stand in the printed spec."""


@dataclass(frozen=True)
class Origin:
    """A place and the layer whose file it is in: `variant leaf`, `effect tyre_slip@vehicle`."""

    place: str
    layer: str

    def __str__(self) -> str:
        """Return `file:line (layer)`."""
        return f"{self.place} ({self.layer})" if self.layer else self.place


@dataclass(frozen=True)
class Row:
    """A value by its key path, where it came from, and what rewrote a part of it, in order."""

    path: str
    value: str
    origin: Origin
    changes: tuple[Origin, ...]

    @property
    def places(self) -> str:
        """All places as one text."""
        return ", changed by ".join(str(origin) for origin in (self.origin, *self.changes))


@dataclass(frozen=True)
class Difference:
    """A key path whose values differ; None where there is none."""

    path: str
    old: Row | None
    new: Row | None


def rows(tree: Table) -> list[Row]:
    """Return every value of a tree in the order of the tree."""
    return list(_rows(tree, ()))


def spec_text(tree: Table) -> str:
    """Return a tree as a spec that can be read again, with the places as comments."""
    return "\n".join(_lines(tree, 0, {row.path: row for row in rows(tree)}, ())) + "\n"


def differences(old: Table, new: Table) -> list[Difference]:
    """Return what differs between two trees, by key path: those of the old first."""
    before = {row.path: row for row in rows(old)}
    after = {row.path: row for row in rows(new)}
    found = []
    for path in dict.fromkeys([*before, *after]):
        a, b = before.get(path), after.get(path)
        if a is None or b is None or a.value != b.value:
            found.append(Difference(path, a, b))
    return found


def difference_text(found: Sequence[Difference]) -> str:
    """Return differences as lines: `-` what was, `+` what is."""
    lines = []
    for difference in found:
        for sign, row in (("-", difference.old), ("+", difference.new)):
            if row:
                lines.append(_commented(f"{sign} {row.path}: {row.value}", row.places))
    return "".join(f"{line}\n" for line in lines)


def _rows(node: Node, path: tuple[str, ...]) -> Iterator[Row]:
    match node:
        case Scalar(text, span, _, changes):
            yield _row(path, text, span, changes)
        case Items(nodes, span):
            parts = [part for part in nodes if isinstance(part, Scalar)]
            changes = tuple(change for part in parts for change in part.changes)
            yield _row(path, _items_text(node), span, changes)
        case Table(entries, span):
            if not entries and path:
                yield _row(path, "{}", span, ())
            for entry in node:
                yield from _rows(entry.node, (*path, entry.key))


def _row(path: tuple[str, ...], text: str, span: Span, changes: tuple[Span, ...]) -> Row:
    origins = dict.fromkeys(_origin(change) for change in changes)
    return Row(".".join(path), text, _origin(span), tuple(origins))


def _origin(span: Span) -> Origin:
    return Origin(f"{span.source.name}:{span.line}", layer_of(span.source))


def layer_of(source: Source) -> str:
    """Return the layer that a source is: an effect at its place, or the kind and name of a file."""
    if source.layer:
        return source.layer
    for line in source.lines:
        match = HEAD.match(line)
        if match:
            return f"{match.group(1)} {match.group(2)}"
    return ""


def _lines(node: Table, depth: int, places: dict[str, Row], path: tuple[str, ...]) -> Iterator[str]:
    for entry in node:
        below = (*path, entry.key)
        head = "  " * depth + _text(entry.key) + ":"
        if isinstance(entry.node, Table) and entry.node.entries:
            yield head
            yield from _lines(entry.node, depth + 1, places, below)
            continue
        row = places[".".join(below)]
        value = _text(row.value) if isinstance(entry.node, Scalar) else row.value
        yield _commented(f"{head} {value}", row.places)


def _commented(text: str, comment: str) -> str:
    return f"{text:<{COLUMN}}  # {comment}"


def _text(text: str) -> str:
    """Return a text as YAML reads it back."""
    is_plain = PLAIN.fullmatch(text) and not text.endswith(" ")
    return text if is_plain else json.dumps(text, ensure_ascii=False)


def _items_text(items: Items) -> str:
    parts = [_text(part.text) if isinstance(part, Scalar) else "..." for part in items.nodes]
    return f"[{', '.join(parts)}]"
