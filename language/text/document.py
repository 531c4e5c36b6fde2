"""Documents: a YAML file as a tree of nodes in which every value has its place."""

from __future__ import annotations

import dataclasses
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from language.text.diagnostic import Problem, Problems, Source, Span, SpecError
from language.text.regular_file import open_regular_file

MAX_BYTES = 4 * 1024 * 1024
"""Largest file that is read [bytes]; a spec written by hand has a few kB."""
LINE_END = re.compile(r"\r\n|[\r\n\x85\u2028\u2029]")
"""The line ends of YAML; str.splitlines accepts more characters."""


@dataclass(frozen=True)
class ScalarNode:
    """A leaf of the tree: its text as written, without quotes; the reader of the key interprets it.

    `changes` are the places of the overlays that rewrote a part of the text, in the order of
    rewriting.
    """

    text: str
    span: Span
    is_quoted: bool = False
    changes: tuple[Span, ...] = ()

    @property
    def text_span(self) -> Span:
        """The span of the text without quotes; atomic if an overlay rewrote a part of the text.

        In that case the quotes are part of the span.
        """
        if self.changes:
            return dataclasses.replace(self.span, is_atomic=True)
        return self.span.subspan(1, len(self.text)) if self.is_quoted else self.span


@dataclass(frozen=True)
class Entry:
    """A key of a mapping: the key, the span of the key and the node of its value."""

    key: str
    span: Span
    node: YamlNode

    @property
    def text_span(self) -> Span:
        """The span of the key without its quotes.

        A key is taken as quoted if its span is 2 characters wider than its text.
        """
        is_quoted = self.span.width == len(self.key) + 2
        return self.span.subspan(1, len(self.key)) if is_quoted else self.span


@dataclass(frozen=True)
class MappingNode:
    """A mapping; the entries are in the order of the file."""

    entries: dict[str, Entry]
    span: Span

    def get(self, key: str) -> YamlNode | None:
        """Return the node of a key, or None if this mapping itself does not have the key."""
        entry = self.entries.get(key)
        return entry.node if entry else None

    def text_of(self, key: str) -> str:
        """Return the text of a key; "" if it is absent or no scalar."""
        node = self.get(key)
        return node.text if isinstance(node, ScalarNode) else ""

    def __iter__(self) -> Iterator[Entry]:
        """Iterate over the entries in the order of the file."""
        return iter(self.entries.values())


@dataclass(frozen=True)
class SequenceNode:
    """A sequence of nodes in the order of the file."""

    nodes: tuple[YamlNode, ...]
    span: Span


YamlNode = ScalarNode | MappingNode | SequenceNode


@dataclass(frozen=True)
class Document:
    """One file: its kind ("automaton", "system", ...), its name and its tree."""

    kind: str
    name: str
    name_span: Span
    root: MappingNode
    source: Source = field(repr=False)


def require_kind(document: Document, kind: str, problems: Problems) -> None:
    """Raise SpecError if the kind of a document is not `kind`; else do nothing.

    The problem, of kind "form" at the name of the document, is added to `problems` first; the error
    carries all problems of the collector.
    """
    if document.kind != kind:
        actual_text, expected_text = (
            f"{'an' if word[0] in 'aeiou' else 'a'} {word}" for word in (document.kind, kind)
        )
        label = f"`{document.name}` is {actual_text}, not {expected_text}"
        problems.error("form", document.name_span, label)
        problems.raise_if_errors()


def read_text(path: Path, display_name: str | None = None) -> tuple[Source, str]:
    """Return the source and the text of a UTF-8 file; a byte order mark is removed.

    The source has the name `display_name`, or else the path, and the lines of the text. Raises
    SpecError with one problem at line 1: "unreadable" if the file does not exist or is not a
    regular file, "huge" if it is larger than MAX_BYTES; or "binary" at the first line that is not
    UTF-8.
    """
    name = display_name or str(path)
    text = decode_utf8(read_regular_file(path, name, MAX_BYTES, "a spec"), name)
    return Source(name, lines_of(text)), text


def read_regular_file(path: Path, name: str, max_bytes: int, what: str) -> bytes:
    """Return the content of a file; `name` and `what` stand for it in messages.

    Raises SpecError with one problem at line 1: "unreadable" if the file does not exist or is not a
    regular file, "huge" if it is larger than `max_bytes`.
    """
    kind = "unreadable"
    try:
        with open_regular_file(path) as file:
            data = file.read(max_bytes + 1)
            if len(data) <= max_bytes:
                return data
            size = max(os.fstat(file.fileno()).st_size, len(data))
        kind = "huge"
        label = f"the file has {size} bytes; {what} has at most {max_bytes}"
    except OSError as error:
        label = f"the file cannot be read: {error.strerror}"
    except ValueError:
        label = "this is not the name of a file"
    raise SpecError([Problem(kind, Span(Source(name), 1, 1), label)])


def decode_utf8(data: bytes, name: str) -> str:
    """Return the text of UTF-8 without a byte order mark.

    Raises SpecError, "binary" at the first line that is not UTF-8.
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        place = Span(Source(name), data.count(b"\n", 0, error.start) + 1, 1)
        label = "this is not UTF-8 text"
        raise SpecError([Problem("binary", place, label, "save it as UTF-8")]) from None


def lines_of(text: str) -> tuple[str, ...]:
    """Return the lines of a text as YAML counts them (LINE_END), without line ends.

    A line end at the end of the text starts no further line. An empty text has no lines.
    """
    *lines, last = LINE_END.split(text)
    return (*lines, last) if last else tuple(lines)
