"""Provenance: the values of an expanded spec with the places and the layers that they came from.

A layer is a file (the base, a variant) or an effect at its place.
"""

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
"""Texts that need no quotes in YAML."""
COMMENT_COLUMN = 64
"""Column of the comment with the places in the printed spec."""


@dataclass(frozen=True)
class Origin:
    """A place `file:line` and its layer: `variant leaf`, `effect tyre_slip@vehicle`."""

    place: str
    layer: str

    def __str__(self) -> str:
        """Return `file:line (layer)`, or `file:line` without a layer."""
        return f"{self.place} ({self.layer})" if self.layer else self.place


@dataclass(frozen=True)
class ProvenanceEntry:
    """A value with its key path, its origin and the origins of later changes of its text."""

    path: str
    value: str
    origin: Origin
    changes: tuple[Origin, ...]

    @property
    def places(self) -> str:
        """The origin and the origins of the changes as one text, separated by `, changed by `."""
        return ", changed by ".join(str(origin) for origin in (self.origin, *self.changes))


@dataclass(frozen=True)
class SpecDifference:
    """A key path with different values in two specs; None stands for a missing value."""

    path: str
    old: ProvenanceEntry | None
    new: ProvenanceEntry | None


def provenance_entries(tree: MappingNode) -> list[ProvenanceEntry]:
    """Return an entry for each scalar, sequence and empty mapping, in the order of the tree.

    A path is the keys joined with `.`. A sequence is one entry with the text `[a, b]`, in which
    items that are not scalars are `...`; an empty mapping has the text `{}`. The root has no entry.
    """
    return list(_iter_entries(tree, ()))


def format_spec(tree: MappingNode) -> str:
    """Return a tree as the YAML text of a spec, with the places of each value as a comment.

    Each level is indented by two blanks, and a sequence is on one line. Comments start at
    COMMENT_COLUMN or after a longer line. Texts that do not match PLAIN_SCALAR are in double
    quotes.
    """
    return (
        "\n".join(_spec_lines(tree, 0, {row.path: row for row in provenance_entries(tree)}, ()))
        + "\n"
    )


def diff_specs(old: MappingNode, new: MappingNode) -> list[SpecDifference]:
    """Return the key paths whose values differ as text, or that only one of two trees has.

    The paths of `old` come first, then the paths that only `new` has, each in the order of its
    tree; spans and the order of keys do not count. The paths are those of `provenance_entries`.
    """
    before = {row.path: row for row in provenance_entries(old)}
    after = {row.path: row for row in provenance_entries(new)}
    result = []
    for path in dict.fromkeys([*before, *after]):
        a, b = before.get(path), after.get(path)
        if a is None or b is None or a.value != b.value:
            result.append(SpecDifference(path, a, b))
    return result


def format_diff(changes: Sequence[SpecDifference]) -> str:
    """Return differences as lines `- path: value` (old) and `+ path: value` (new).

    A missing value has no line. Each line has the places of the value as a comment at
    COMMENT_COLUMN and ends with a line feed. Without differences the text is empty.
    """
    lines = []
    for difference in changes:
        for sign, row in (("-", difference.old), ("+", difference.new)):
            if row:
                lines.append(_append_comment(f"{sign} {row.path}: {row.value}", row.places))
    return "".join(f"{line}\n" for line in lines)


def _iter_entries(node: YamlNode, path: tuple[str, ...]) -> Iterator[ProvenanceEntry]:
    """Yield the entries below a node at `path`."""
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
    """Return the entry of a value; repeated origins of its changes are removed."""
    origins = dict.fromkeys(_origin_of(change) for change in changes)
    return ProvenanceEntry(".".join(path), text, _origin_of(span), tuple(origins))


def _origin_of(span: Span) -> Origin:
    """Return the origin of a span."""
    return Origin(f"{span.source.name}:{span.line}", layer_of(span.source))


def layer_of(source: Source) -> str:
    """Return the layer of a source: its `layer` (an effect with its place), or else `kind name`.

    Kind and name are those of the first line that is a head, like `variant leaf`. The text is empty
    if the source has neither.
    """
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
    """Yield the lines of a mapping as YAML, two blanks for each level of depth."""
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
    """Return a line with a comment at COMMENT_COLUMN."""
    return f"{text:<{COMMENT_COLUMN}}  # {comment}"


def _quote_if_needed(text: str) -> str:
    """Return a text as a YAML scalar: plain if it matches PLAIN_SCALAR, else in quotes."""
    is_plain = PLAIN_SCALAR.fullmatch(text) and not text.endswith(" ")
    return text if is_plain else json.dumps(text, ensure_ascii=False)


def _format_sequence(items: SequenceNode) -> str:
    """Return a sequence on one line; items that are not scalars become `...`."""
    parts = [
        _quote_if_needed(part.text) if isinstance(part, ScalarNode) else "..."
        for part in items.nodes
    ]
    return f"[{', '.join(parts)}]"
