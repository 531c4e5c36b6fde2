"""YAML tree: the text of a spec as nodes that know their places; nothing is expanded."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import yaml

from language.text.diagnostic import Problems, Source, Span
from language.text.document import Entry, MappingNode, ScalarNode, SequenceNode, YamlNode, lines_of

Mark = Any
"""A place as libyaml gives it: line and column from 0; its types know it under two names."""
MAX_DEPTH = 64
"""Deepest nesting read; the language needs less than 12."""
MAX_NODES = 200_000
"""Most keys and values read; a spec of 4 MiB has about as many."""
MAX_PROBLEMS = 100
"""Problems of form after which reading ends."""


def parse_yaml(source: Source, text: str) -> MappingNode:
    """Parse YAML text into a tree. Raises SpecError with every problem of form found."""
    problems = Problems()
    builder = _YamlBuilder(source, problems)
    try:
        for event in yaml.parse(text, Loader=yaml.CSafeLoader):
            builder.handle_event(event)
            if builder.is_aborted or len(problems.reported) >= MAX_PROBLEMS:
                break
    except yaml.YAMLError as error:
        problems.error("yaml", *_describe_error(source, text, error))
    problems.raise_if_errors()
    if builder.root is None:
        place = Span(source, 1, 1)
        problems.error("empty", place, "the file is empty", "a spec starts with `language: 1`")
    elif not isinstance(builder.root, MappingNode):
        label = "a spec is a mapping that starts with `language: 1`"
        problems.error("form", builder.root.span, label)
    problems.raise_if_errors()
    assert isinstance(builder.root, MappingNode)
    return builder.root


def _describe_error(source: Source, text: str, error: yaml.YAMLError) -> tuple[Span, str, str]:
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
class _OpenCollection:
    """A mapping or list that is being read."""

    start: Mark
    is_mapping: bool
    nodes: list[YamlNode] = field(default_factory=list)
    entries: dict[str, Entry] = field(default_factory=dict)
    split_keys: set[str] = field(default_factory=set)
    key: ScalarNode | MappingNode | SequenceNode | None = None


class _YamlBuilder:
    """Takes events one by one; the levels that are open are a list, so depth costs no stack."""

    def __init__(self, source: Source, problems: Problems) -> None:
        self.source = source
        self.problems = problems
        self.root: YamlNode | None = None
        self.open_levels: list[_OpenCollection] = []
        self.node_count = 0
        self.document_count = 0
        self.is_aborted = False

    def handle_event(self, event: yaml.Event) -> None:
        match event:
            case yaml.ScalarEvent():
                self._reject_anchor_and_tag(event)
                quoted = event.style in ("'", '"')
                self._add_node(
                    ScalarNode(
                        event.value, self._span_between(event.start_mark, event.end_mark), quoted
                    )
                )
            case yaml.MappingStartEvent() | yaml.SequenceStartEvent():
                self._reject_anchor_and_tag(event)
                is_mapping = isinstance(event, yaml.MappingStartEvent)
                self.open_levels.append(_OpenCollection(event.start_mark, is_mapping))
                if len(self.open_levels) > MAX_DEPTH:
                    self._abort(event.start_mark, f"nested deeper than {MAX_DEPTH} levels", "depth")
            case yaml.MappingEndEvent() | yaml.SequenceEndEvent():
                level = self.open_levels.pop()
                for key in level.split_keys:
                    self._report_split_value(level.entries[key])
                span = self._span_between(level.start, event.end_mark)
                ended: YamlNode = MappingNode(level.entries, span)
                self._add_node(
                    ended if level.is_mapping else SequenceNode(tuple(level.nodes), span)
                )
            case yaml.AliasEvent():
                label = "an alias (`*name`) is not part of the language"
                span = self._span_between(event.start_mark, event.start_mark)
                self.problems.error("yaml-feature", span, label, "write the value itself")
                self._add_node(ScalarNode("", span))
            case yaml.DocumentStartEvent():
                self.document_count += 1
                if self.document_count > 1:
                    label = "this is not YAML: a second document starts here, and a file holds one"
                    self._abort(event.start_mark, label, "yaml")

    def _abort(self, mark: Mark, label: str, kind: str) -> None:
        self.is_aborted = True
        self.problems.error(kind, self._span_between(mark, mark), label)

    def _reject_anchor_and_tag(self, event: yaml.NodeEvent) -> None:
        place = self._span_between(event.start_mark, event.start_mark)
        if event.anchor is not None:
            label = "an anchor (`&name`) is not part of the language"
            self.problems.error("yaml-feature", place, label, "write the value where it is needed")
        if getattr(event, "tag", None) is not None:
            label = "a tag (`!name`) is not part of the language"
            hint = "leave it out; the contrary of a condition is written `not a`"
            self.problems.error("yaml-feature", place, label, hint)

    def _add_node(self, node: YamlNode) -> None:
        self.node_count += 1
        if self.node_count > MAX_NODES and self.open_levels:
            mark = self.open_levels[-1].start
            self._abort(mark, f"a spec has at most {MAX_NODES} keys and values", "huge")
        if not self.open_levels:
            self.root = node
            return
        level = self.open_levels[-1]
        if not level.is_mapping:
            level.nodes.append(node)
        elif level.key is None:
            level.key = node
        else:
            self._add_entry(level, level.key, node)
            level.key = None

    def _join_split_value(self, level: _OpenCollection, key: YamlNode, node: YamlNode) -> bool:
        """Join a value that `{...}` ended at a comma: a `(` is open, what follows has no value."""
        last = next(reversed(level.entries.values()), None)
        if not (last and isinstance(last.node, ScalarNode) and isinstance(key, ScalarNode)):
            return False
        value = last.node
        is_open = not value.quoted and value.text.count("(") > value.text.count(")")
        if (
            not is_open
            or key.quoted
            or not isinstance(node, ScalarNode)
            or node.text
            or node.quoted
        ):
            return False
        text = f"{value.text}, {key.text}"
        width = key.span.column + key.span.width - value.span.column
        is_one_line = key.span.line == value.span.line
        span = replace(value.span, width=width) if is_one_line else value.span
        level.entries[last.key] = replace(last, node=ScalarNode(text, span))
        level.split_keys.add(last.key)
        return True

    def _report_split_value(self, entry: Entry) -> None:
        assert isinstance(entry.node, ScalarNode)
        label = "in `{...}` YAML ends this value at its comma"
        hint = f'quote it: `{entry.key}: "{entry.node.text}"`'
        self.problems.error("yaml-feature", entry.node.span, label, hint)

    def _add_entry(self, level: _OpenCollection, key: YamlNode, node: YamlNode) -> None:
        if self._join_split_value(level, key, node):
            return
        if not isinstance(key, ScalarNode):
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

    def _span_between(self, start: Mark, end: Mark) -> Span:
        width = end.column - start.column if end.line == start.line else 1
        return Span(self.source, start.line + 1, start.column + 1, max(1, width))
