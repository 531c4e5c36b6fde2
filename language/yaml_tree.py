"""YAML tree: the text of a spec as nodes that know their places; nothing is expanded."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import yaml

from language.document import Entry, Items, Node, Scalar, Table, lines_of
from language.problem import Problems, Source, Span

Mark = Any
"""A place as libyaml gives it: line and column from 0; its types know it under two names."""
MAX_DEPTH = 64
"""Deepest nesting read; the language needs less than 12."""
MAX_NODES = 200_000
"""Most keys and values read; a spec of 4 MiB has about as many."""
MAX_FOUND = 100
"""Problems of form after which reading ends."""


def parse(source: Source, text: str) -> Table:
    """Parse YAML text into a tree. Raises SpecError with every problem of form found."""
    problems = Problems()
    builder = _Builder(source, problems)
    try:
        for event in yaml.parse(text, Loader=yaml.CSafeLoader):
            builder.take(event)
            if builder.is_full or len(problems.found) >= MAX_FOUND:
                break
    except yaml.YAMLError as error:
        problems.error("yaml", *_describe(source, text, error))
    problems.stop_if_any()
    if builder.root is None:
        place = Span(source, 1, 1)
        problems.error("empty", place, "the file is empty", "a spec starts with `language: 1`")
    elif not isinstance(builder.root, Table):
        label = "a spec is a mapping that starts with `language: 1`"
        problems.error("form", builder.root.span, label)
    problems.stop_if_any()
    assert isinstance(builder.root, Table)
    return builder.root


def _describe(source: Source, text: str, error: yaml.YAMLError) -> tuple[Span, str, str]:
    if isinstance(error, yaml.reader.ReaderError):
        before = lines_of(f"{text.encode()[: error.position].decode(errors='ignore')}|")
        label = f"this is not YAML: it has the character U+{error.character:04X}"
        return Span(source, len(before), len(before[-1])), label, "delete it, or write it in words"
    mark = getattr(error, "problem_mark", None)
    what = getattr(error, "problem", None) or getattr(error, "reason", None) or "not valid YAML"
    if mark is None:
        return Span(source, 1, 1), f"this is not YAML: {what}", ""
    span = Span(source, mark.line + 1, mark.column + 1)
    context = getattr(error, "context", None)
    hint = "a bracket or a quote is not closed, or a key has no `:`"
    if context and "tag" in context:
        hint = "`!` starts a tag in YAML; the contrary of a condition is written `not a`"
    elif context and "flow" in context:
        hint = "in `{...}` quote an expression that has a comma"
    elif "found character that cannot start any token" in what:
        hint = "YAML is indented with blanks, not with tabs; quote a text that starts with a sign"
    elif "mapping values are not allowed" in what:
        hint = "quote a text that has a `: `"
    return span, f"this is not YAML: {what}", hint


@dataclass
class _Open:
    """A mapping or list that is being read."""

    start: Mark
    is_mapping: bool
    nodes: list[Node] = field(default_factory=list)
    entries: dict[str, Entry] = field(default_factory=dict)
    cut: set[str] = field(default_factory=set)
    key: Scalar | Table | Items | None = None


class _Builder:
    """Takes events one by one; the levels that are open are a list, so depth costs no stack."""

    def __init__(self, source: Source, problems: Problems) -> None:
        self.source = source
        self.problems = problems
        self.root: Node | None = None
        self.open: list[_Open] = []
        self.nodes = 0
        self.documents = 0
        self.is_full = False

    def take(self, event: yaml.Event) -> None:
        match event:
            case yaml.ScalarEvent():
                self._refuse(event)
                quoted = event.style in ("'", '"')
                self._add(Scalar(event.value, self._span(event.start_mark, event.end_mark), quoted))
            case yaml.MappingStartEvent() | yaml.SequenceStartEvent():
                self._refuse(event)
                is_mapping = isinstance(event, yaml.MappingStartEvent)
                self.open.append(_Open(event.start_mark, is_mapping))
                if len(self.open) > MAX_DEPTH:
                    self._end(event.start_mark, f"nested deeper than {MAX_DEPTH} levels", "depth")
            case yaml.MappingEndEvent() | yaml.SequenceEndEvent():
                level = self.open.pop()
                for key in level.cut:
                    self._report_cut(level.entries[key])
                span = self._span(level.start, event.end_mark)
                ended: Node = Table(level.entries, span)
                self._add(ended if level.is_mapping else Items(tuple(level.nodes), span))
            case yaml.AliasEvent():
                label = "an alias (`*name`) is not part of the language"
                span = self._span(event.start_mark, event.start_mark)
                self.problems.error("yaml-feature", span, label, "write the value itself")
                self._add(Scalar("", span))
            case yaml.DocumentStartEvent():
                self.documents += 1
                if self.documents > 1:
                    label = "this is not YAML: a second document starts here, and a file holds one"
                    self._end(event.start_mark, label, "yaml")

    def _end(self, mark: Mark, label: str, kind: str) -> None:
        self.is_full = True
        self.problems.error(kind, self._span(mark, mark), label)

    def _refuse(self, event: yaml.NodeEvent) -> None:
        place = self._span(event.start_mark, event.start_mark)
        if event.anchor is not None:
            label = "an anchor (`&name`) is not part of the language"
            self.problems.error("yaml-feature", place, label, "write the value where it is needed")
        if getattr(event, "tag", None) is not None:
            label = "a tag (`!name`) is not part of the language"
            hint = "leave it out; the contrary of a condition is written `not a`"
            self.problems.error("yaml-feature", place, label, hint)

    def _add(self, node: Node) -> None:
        self.nodes += 1
        if self.nodes > MAX_NODES and self.open:
            mark = self.open[-1].start
            self._end(mark, f"a spec has at most {MAX_NODES} keys and values", "huge")
        if not self.open:
            self.root = node
            return
        level = self.open[-1]
        if not level.is_mapping:
            level.nodes.append(node)
        elif level.key is None:
            level.key = node
        else:
            self._entry(level, level.key, node)
            level.key = None

    def _is_cut(self, level: _Open, key: Node, node: Node) -> bool:
        """Join a value that `{...}` ended at a comma: a `(` is open, what follows has no value."""
        last = next(reversed(level.entries.values()), None)
        if not (last and isinstance(last.node, Scalar) and isinstance(key, Scalar)):
            return False
        value = last.node
        is_open = not value.quoted and value.text.count("(") > value.text.count(")")
        if not is_open or key.quoted or not isinstance(node, Scalar) or node.text or node.quoted:
            return False
        text = f"{value.text}, {key.text}"
        width = key.span.column + key.span.width - value.span.column
        is_one_line = key.span.line == value.span.line
        span = replace(value.span, width=width) if is_one_line else value.span
        level.entries[last.key] = replace(last, node=Scalar(text, span))
        level.cut.add(last.key)
        return True

    def _report_cut(self, entry: Entry) -> None:
        assert isinstance(entry.node, Scalar)
        label = "in `{...}` YAML ends this value at its comma"
        hint = f'quote it: `{entry.key}: "{entry.node.text}"`'
        self.problems.error("yaml-feature", entry.node.span, label, hint)

    def _entry(self, level: _Open, key: Node, node: Node) -> None:
        if self._is_cut(level, key, node):
            return
        if not isinstance(key, Scalar):
            label = "a key is a name, not a list or a mapping"
            self.problems.error("key", key.span, label, "quote a text with brackets")
        elif key.text == "<<":
            label = "a merge key (`<<`) is not part of the language"
            hint = "lay a variant over the spec, or a mode over a template with `like`"
            self.problems.error("yaml-feature", key.span, label, hint)
        elif key.text in level.entries:
            first = level.entries[key.text].span
            label = f"`{key.text}` is given twice"
            self.problems.error("duplicate", key.span, label, f"it is given first at {first}")
        else:
            level.entries[key.text] = Entry(key.text, key.span, node)

    def _span(self, start: Mark, end: Mark) -> Span:
        width = end.column - start.column if end.line == start.line else 1
        return Span(self.source, start.line + 1, start.column + 1, max(1, width))
