"""YAML parser: the text of a spec as a tree of nodes with spans.

Anchors, aliases, tags and merge keys are problems: the tree is what the text shows.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import yaml

from language.text.diagnostic import Problems, Source, Span
from language.text.document import Entry, MappingNode, ScalarNode, SequenceNode, YamlNode, lines_of

Mark = Any
"""A position of libyaml: line and column, counted from 0."""
MAX_DEPTH = 64
"""Largest depth of nesting; the language needs less than 12."""
MAX_NODES = 200_000
"""Largest number of nodes; a spec of 4 MiB has about as many."""
MAX_PROBLEMS = 100
"""Number of problems after which parsing stops."""


def parse_yaml(source: Source, text: str) -> MappingNode:
    """Return the tree of a YAML text; values stay texts, and keys keep the order of the file.

    Raises SpecError with the problems found: text that is not YAML, anchors, aliases, tags, merge
    keys, duplicate keys, keys that are no scalars, a value split at a comma in `{...}`, a second
    document, an empty text, a root that is no mapping. Parsing stops after MAX_PROBLEMS problems,
    at an error of YAML, below MAX_DEPTH levels and after MAX_NODES nodes.
    """
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
    """Return the span, the label and the help text for an error of libyaml."""
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
    if not (context and "flow" in context):
        label = _describe_indentation(text.splitlines()[: mark.line + 1])
        if label:
            hint = "keys of one mapping have the same indentation"
            return span, f"this is not YAML: {label}", hint
    return span, f"this is not YAML: {what}", hint


def _describe_indentation(lines: Sequence[str]) -> str:
    """Return what is wrong with the indentation of the last line; "" if it fits.

    It fits if a line above has it with no line of smaller indentation between them, or if the line
    before it is a key without a value and has a smaller one. Lines above without text and comments
    are skipped.
    """
    *above, last = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
    own = _indentation(last)
    if not above or not re.match(r"\s*[\w.\-]+ *:( |$)", last):
        return ""
    before = _indentation(above[-1])
    if own > before and re.search(r":\s*(#.*)?$", above[-1]):
        return ""
    enclosing, smallest = [], before + 1
    for line in reversed(above):
        if _indentation(line) < smallest:
            smallest = _indentation(line)
            enclosing.append(smallest)
    if own in enclosing:
        return ""
    blanks = " or ".join(str(number) for number in enclosing)
    return f"this line is indented by {own}, the lines above it by {blanks}"


def _indentation(line: str) -> int:
    """Return the number of blanks at the start of a line."""
    return len(line) - len(line.lstrip(" "))


@dataclass
class _OpenCollection:
    """A mapping or sequence whose end has not been read yet.

    `split_keys` are the keys whose value was joined from parts that YAML had split at a comma.
    """

    start: Mark
    is_mapping: bool
    nodes: list[YamlNode] = field(default_factory=list)
    entries: dict[str, Entry] = field(default_factory=dict)
    split_keys: set[str] = field(default_factory=set)
    key: ScalarNode | MappingNode | SequenceNode | None = None


class _YamlBuilder:
    """Builder of the tree from parser events, with a list of open collections, no recursion."""

    def __init__(self, source: Source, problems: Problems) -> None:
        self.source = source
        self.problems = problems
        self.root: YamlNode | None = None
        self.open_levels: list[_OpenCollection] = []
        self.node_count = 0
        self.document_count = 0
        self.is_aborted = False

    def handle_event(self, event: yaml.Event) -> None:
        """Add the node of an event to the tree, or report a feature that is not allowed."""
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
        """Report an error after which no further event is read."""
        self.is_aborted = True
        self.problems.error(kind, self._span_between(mark, mark), label)

    def _reject_anchor_and_tag(self, event: yaml.NodeEvent) -> None:
        """Report an anchor or a tag of a node."""
        place = self._span_between(event.start_mark, event.start_mark)
        if event.anchor is not None:
            label = "an anchor (`&name`) is not part of the language"
            self.problems.error("yaml-feature", place, label, "write the value where it is needed")
        if getattr(event, "tag", None) is not None:
            label = "a tag (`!name`) is not part of the language"
            hint = "leave it out; the contrary of a condition is written `not a`"
            self.problems.error("yaml-feature", place, label, hint)

    def _add_node(self, node: YamlNode) -> None:
        """Add a node to the innermost open collection; without one it becomes the root."""
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
        """Join a value with the key that follows it if YAML split the text of the value at a comma.

        In `{a: f(x, y)}` YAML reads the value `f(x` and a key `y)` without a value. Such a pair is
        recognised by an open `(` in the unquoted value. Return whether the parts were joined.
        """
        last = next(reversed(level.entries.values()), None)
        if not (last and isinstance(last.node, ScalarNode) and isinstance(key, ScalarNode)):
            return False
        value = last.node
        is_open = not value.is_quoted and value.text.count("(") > value.text.count(")")
        if (
            not is_open
            or key.is_quoted
            or not isinstance(node, ScalarNode)
            or node.text
            or node.is_quoted
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
        """Report a value that YAML split at a comma, with the quoted form as help."""
        assert isinstance(entry.node, ScalarNode)
        label = "in `{...}` YAML ends this value at its comma"
        hint = f'quote it: `{entry.key}: "{entry.node.text}"`'
        self.problems.error("yaml-feature", entry.node.span, label, hint)

    def _add_entry(self, level: _OpenCollection, key: YamlNode, node: YamlNode) -> None:
        """Add a key and its value to a mapping.

        Instead report `<<`, a duplicate key, and a key that is not a scalar.
        """
        if self._join_split_value(level, key, node):
            return
        if not isinstance(key, ScalarNode):
            label = "a key is a name, not a list or a mapping"
            self.problems.error("key", key.span, label, "quote a text with brackets")
        elif key.text == "<<":
            label = "a merge key (`<<`) is not part of the language"
            hint = "write a variant of the spec, or a template that modes name with `like`"
            self.problems.error("yaml-feature", key.span, label, hint)
        elif key.text in level.entries:
            first = level.entries[key.text].span
            label = f"`{key.text}` is given twice"
            self.problems.error("duplicate", key.span, label, f"it is given first at {first}")
        else:
            level.entries[key.text] = Entry(key.text, key.span, node)

    def _span_between(self, start: Mark, end: Mark) -> Span:
        """Return the span between two marks; the width is 1 if they are on different lines."""
        width = end.column - start.column if end.line == start.line else 1
        return Span(self.source, start.line + 1, start.column + 1, max(1, width))
