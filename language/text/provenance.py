"""Provenance: every value of an expanded spec with the places and layers that it came from."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from language.text.diagnostic import Source, Span
from language.text.document import MappingNode, ScalarNode, SequenceNode, YamlNode

HEAD_PATTERN = re.compile(
    r"^(automaton|system|scenario|map|variant|effect|study|test|calibration): *(\S+)"
)
PLAIN_SCALAR = re.compile(
    r"[A-Za-z0-9$(.][A-Za-z0-9_ .+*/^()<>=@$-]*|-[0-9(A-Za-z][A-Za-z0-9_ .+*/^()<>=@$-]*"
)
"""Texts that YAML and we read alike without quotes."""
COMMENT_COLUMN = 64
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
class ProvenanceEntry:
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
class SpecDifference:
    """A key path whose values differ; None where there is none."""

    path: str
    old: ProvenanceEntry | None
    new: ProvenanceEntry | None


def provenance_entries(tree: MappingNode) -> list[ProvenanceEntry]:
    """Return every value of a tree in the order of the tree."""
    return list(_iter_entries(tree, ()))


def format_spec(tree: MappingNode) -> str:
    """Return a tree as a spec that can be read again, with the places as comments."""
    return (
        "\n".join(_spec_lines(tree, 0, {row.path: row for row in provenance_entries(tree)}, ()))
        + "\n"
    )


def diff_specs(old: MappingNode, new: MappingNode) -> list[SpecDifference]:
    """Return what differs between two trees, by key path: those of the old first."""
    before = {row.path: row for row in provenance_entries(old)}
    after = {row.path: row for row in provenance_entries(new)}
    result = []
    for path in dict.fromkeys([*before, *after]):
        a, b = before.get(path), after.get(path)
        if a is None or b is None or a.value != b.value:
            result.append(SpecDifference(path, a, b))
    return result


def format_diff(changes: Sequence[SpecDifference]) -> str:
    """Return differences as lines: `-` what was, `+` what is."""
    lines = []
    for difference in changes:
        for sign, row in (("-", difference.old), ("+", difference.new)):
            if row:
                lines.append(_append_comment(f"{sign} {row.path}: {row.value}", row.places))
    return "".join(f"{line}\n" for line in lines)


def _iter_entries(node: YamlNode, path: tuple[str, ...]) -> Iterator[ProvenanceEntry]:
    match node:
        case ScalarNode(text, span, _, changes):
            yield _provenance_entry(path, text, span, changes)
        case SequenceNode(nodes, span):
            parts = [part for part in nodes if isinstance(part, ScalarNode)]
            changes = tuple(change for part in parts for change in part.changes)
            yield _provenance_entry(path, _format_sequence(node), span, changes)
        case MappingNode(entries, span):
            if not entries and path:
                yield _provenance_entry(path, "{}", span, ())
            for entry in node:
                yield from _iter_entries(entry.node, (*path, entry.key))


def _provenance_entry(
    path: tuple[str, ...], text: str, span: Span, changes: tuple[Span, ...]
) -> ProvenanceEntry:
    origins = dict.fromkeys(_origin_of(change) for change in changes)
    return ProvenanceEntry(".".join(path), text, _origin_of(span), tuple(origins))


def _origin_of(span: Span) -> Origin:
    return Origin(f"{span.source.name}:{span.line}", layer_of(span.source))


def layer_of(source: Source) -> str:
    """Return the layer that a source is: an effect at its place, or the kind and name of a file."""
    if source.layer:
        return source.layer
    for line in source.lines:
        match = HEAD_PATTERN.match(line)
        if match:
            return f"{match.group(1)} {match.group(2)}"
    return ""


def _spec_lines(
    node: MappingNode, depth: int, places: dict[str, ProvenanceEntry], path: tuple[str, ...]
) -> Iterator[str]:
    for entry in node:
        below = (*path, entry.key)
        head = "  " * depth + _quote_if_needed(entry.key) + ":"
        if isinstance(entry.node, MappingNode) and entry.node.entries:
            yield head
            yield from _spec_lines(entry.node, depth + 1, places, below)
            continue
        row = places[".".join(below)]
        value = _quote_if_needed(row.value) if isinstance(entry.node, ScalarNode) else row.value
        yield _append_comment(f"{head} {value}", row.places)


def _append_comment(text: str, comment: str) -> str:
    return f"{text:<{COMMENT_COLUMN}}  # {comment}"


def _quote_if_needed(text: str) -> str:
    """Return a text as YAML reads it back."""
    is_plain = PLAIN_SCALAR.fullmatch(text) and not text.endswith(" ")
    return text if is_plain else json.dumps(text, ensure_ascii=False)


def _format_sequence(items: SequenceNode) -> str:
    parts = [
        _quote_if_needed(part.text) if isinstance(part, ScalarNode) else "..."
        for part in items.nodes
    ]
    return f"[{', '.join(parts)}]"
