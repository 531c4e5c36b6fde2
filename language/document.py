"""Document: YAML text as a tree in which every value knows its file, line and column."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from language.problem import Problems, Source, Span, SpecError

MAX_BYTES = 4 * 1024 * 1024
"""Largest spec read: hand-written specs are a few kB; more is a wrong file."""
MAX_DEPTH = 64
"""Deepest nesting read; the language needs less than 12."""

REFUSED_TOKENS = {
    yaml.AnchorToken: "an anchor (`&name`)",
    yaml.AliasToken: "an alias (`*name`)",
    yaml.TagToken: "a tag (`!name`)",
}


@dataclass(frozen=True)
class Scalar:
    """A leaf: its text as written (quotes removed), resolved by who reads it.

    `changes` are the places of the overlays that rewrote a part of the text, in order.
    """

    text: str
    span: Span
    quoted: bool = False
    changes: tuple[Span, ...] = ()

    @property
    def text_span(self) -> Span:
        """The place of the first character of the text itself, behind an opening quote."""
        if self.changes:
            return dataclasses.replace(self.span, whole=True)
        return self.span.inside(1, len(self.text)) if self.quoted else self.span


@dataclass(frozen=True)
class Entry:
    """A key of a mapping with the place of the key and the value."""

    key: str
    span: Span
    node: Node


@dataclass(frozen=True)
class Table:
    """A mapping, in the order of the file."""

    entries: dict[str, Entry]
    span: Span

    def get(self, key: str) -> Node | None:
        """Return the value of a key, or None."""
        entry = self.entries.get(key)
        return entry.node if entry else None

    def __iter__(self) -> Iterator[Entry]:
        """Iterate over the entries in the order of the file."""
        return iter(self.entries.values())


@dataclass(frozen=True)
class Items:
    """A sequence."""

    nodes: tuple[Node, ...]
    span: Span


Node = Scalar | Table | Items


@dataclass(frozen=True)
class Document:
    """One file: its kind (automaton, system, ...), its name and its tree."""

    kind: str
    name: str
    name_span: Span
    root: Table
    source: Source = field(repr=False)


def read_text(path: Path, shown: str | None = None) -> tuple[Source, str]:
    """Read a file as UTF-8 text. Raises SpecError for a missing, huge or binary file."""
    name = shown or str(path)
    place = Span(Source(name), 1, 1)
    problems = Problems()
    try:
        size = path.stat().st_size
        data = path.read_bytes() if size <= MAX_BYTES else b""
    except OSError as error:
        problems.error("unreadable", place, f"the file cannot be read: {error.strerror}")
        raise SpecError(problems.found) from None
    if size > MAX_BYTES:
        problems.error("huge", place, f"the file has {size} bytes; a spec has at most {MAX_BYTES}")
        raise SpecError(problems.found)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        place = Span(Source(name), line, 1)
        problems.error("binary", place, "this is not UTF-8 text", "a spec is a YAML text file")
        raise SpecError(problems.found) from None
    return Source(name, tuple(text.splitlines())), text


def parse(source: Source, text: str) -> Table:
    """Parse YAML text into a tree. Raises SpecError with every problem of form found."""
    problems = Problems()
    try:
        _refuse_tokens(source, text, problems)
        problems.stop_if_any()
        root = yaml.compose(text, Loader=yaml.CSafeLoader)
    except yaml.YAMLError as error:
        problems.error("yaml", *_describe(source, error))
        raise SpecError(problems.found) from None
    place = Span(source, 1, 1)
    if root is None:
        problems.error("empty", place, "the file is empty", "a spec starts with `language: 1`")
        raise SpecError(problems.found)
    tree = _build(source, root, problems)
    if not isinstance(tree, Table):
        problems.error("form", tree.span, "a spec is a mapping that starts with `language: 1`")
    problems.stop_if_any()
    assert isinstance(tree, Table)
    return tree


def _describe(source: Source, error: yaml.YAMLError) -> tuple[Span, str, str]:
    mark = getattr(error, "problem_mark", None)
    what = getattr(error, "problem", None) or getattr(error, "reason", None) or "not valid YAML"
    if mark is None:
        return Span(source, 1, 1), f"this is not YAML: {what}", ""
    span = Span(source, mark.line + 1, mark.column + 1)
    context = getattr(error, "context", None)
    hint = (
        "in `{...}` quote an expression that has a comma" if context and "flow" in context else ""
    )
    return span, f"this is not YAML: {what}", hint


def _refuse_tokens(source: Source, text: str, problems: Problems) -> None:
    depth = 0
    for token in yaml.scan(text, Loader=yaml.CSafeLoader):
        if isinstance(
            token, yaml.BlockEndToken | yaml.FlowMappingEndToken | yaml.FlowSequenceEndToken
        ):
            depth -= 1
        elif isinstance(
            token,
            yaml.BlockMappingStartToken
            | yaml.BlockSequenceStartToken
            | yaml.FlowMappingStartToken
            | yaml.FlowSequenceStartToken,
        ):
            depth += 1
        span = Span(source, token.start_mark.line + 1, token.start_mark.column + 1)
        if depth > MAX_DEPTH:
            problems.error("depth", span, f"nested deeper than {MAX_DEPTH} levels")
            return
        for kind, name in REFUSED_TOKENS.items():
            if isinstance(token, kind):
                problems.error("yaml-feature", span, f"{name} is not part of the language")


def _build(source: Source, node: yaml.Node, problems: Problems) -> Node:
    span = _span(source, node)
    if isinstance(node, yaml.ScalarNode):
        return Scalar(node.value, span, node.style in ("'", '"'))
    if isinstance(node, yaml.SequenceNode):
        return Items(tuple(_build(source, item, problems) for item in node.value), span)
    entries: dict[str, Entry] = {}
    for key, value in node.value:
        key_span = _span(source, key)
        built = _build(source, value, problems)
        if not isinstance(key, yaml.ScalarNode):
            problems.error("key", key_span, "a key is a name, not a list or a mapping")
        elif key.value == "<<":
            problems.error(
                "yaml-feature", key_span, "a merge key (`<<`) is not part of the language"
            )
        elif key.value in entries:
            first = entries[key.value].span
            problems.error(
                "duplicate",
                key_span,
                f"`{key.value}` is given twice",
                f"it is given first at {first}",
            )
        else:
            entries[key.value] = Entry(key.value, key_span, built)
    return Table(entries, span)


def _span(source: Source, node: yaml.Node) -> Span:
    start, end = node.start_mark, node.end_mark
    width = end.column - start.column if end.line == start.line else 1
    return Span(source, start.line + 1, start.column + 1, max(1, width))
