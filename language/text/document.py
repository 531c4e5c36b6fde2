"""Document: YAML text as a tree in which every value knows its file, line and column."""

from __future__ import annotations

import dataclasses
import re
import stat
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from language.text.diagnostic import Problems, Source, Span, SpecError

MAX_BYTES = 4 * 1024 * 1024
"""Largest spec read: hand-written specs are a few kB; more is a wrong file."""
LINE_END = re.compile(r"\r\n|[\r\n\x85\u2028\u2029]")
"""What ends a line for YAML; str.splitlines knows more."""


@dataclass(frozen=True)
class ScalarNode:
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
            return dataclasses.replace(self.span, is_atomic=True)
        return self.span.subspan(1, len(self.text)) if self.quoted else self.span


@dataclass(frozen=True)
class Entry:
    """A key of a mapping with the place of the key and the value."""

    key: str
    span: Span
    node: YamlNode

    @property
    def text_span(self) -> Span:
        """The place of the key itself, without its quotes."""
        is_quoted = self.span.width == len(self.key) + 2
        return self.span.subspan(1, len(self.key)) if is_quoted else self.span


@dataclass(frozen=True)
class MappingNode:
    """A mapping, in the order of the file."""

    entries: dict[str, Entry]
    span: Span

    def get(self, key: str) -> YamlNode | None:
        """Return the value of a key, or None."""
        entry = self.entries.get(key)
        return entry.node if entry else None

    def __iter__(self) -> Iterator[Entry]:
        """Iterate over the entries in the order of the file."""
        return iter(self.entries.values())


@dataclass(frozen=True)
class SequenceNode:
    """A sequence."""

    nodes: tuple[YamlNode, ...]
    span: Span


YamlNode = ScalarNode | MappingNode | SequenceNode


@dataclass(frozen=True)
class Document:
    """One file: its kind (automaton, system, ...), its name and its tree."""

    kind: str
    name: str
    name_span: Span
    root: MappingNode
    source: Source = field(repr=False)


def require_kind(document: Document, kind: str, problems: Problems) -> None:
    """Report a document of another kind, and stop. Raises SpecError."""
    if document.kind != kind:
        given, wanted = (
            f"{'an' if each[0] in 'aeiou' else 'a'} {each}" for each in (document.kind, kind)
        )
        label = f"`{document.name}` is {given}, not {wanted}"
        problems.error("form", document.name_span, label)
        problems.raise_if_errors()


def read_text(path: Path, display_name: str | None = None) -> tuple[Source, str]:
    """Read a file as UTF-8 text. Raises SpecError for a missing, huge or binary file."""
    name = display_name or str(path)
    place = Span(Source(name), 1, 1)
    problems = Problems()
    try:
        status = path.stat()
        size = status.st_size
        if not stat.S_ISREG(status.st_mode):
            label = "the file cannot be read: it is a folder, a pipe or a device"
            problems.error("unreadable", place, label)
        problems.raise_if_errors()
        data = path.read_bytes() if size <= MAX_BYTES else b""
    except OSError as error:
        problems.error("unreadable", place, f"the file cannot be read: {error.strerror}")
        raise SpecError(problems.reported) from None
    except ValueError:
        problems.error("unreadable", place, "this is not the name of a file")
        raise SpecError(problems.reported) from None
    if size > MAX_BYTES:
        problems.error("huge", place, f"the file has {size} bytes; a spec has at most {MAX_BYTES}")
        raise SpecError(problems.reported)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        place = Span(Source(name), line, 1)
        problems.error("binary", place, "this is not UTF-8 text", "save it as UTF-8")
        raise SpecError(problems.reported) from None
    return Source(name, lines_of(text)), text


def lines_of(text: str) -> tuple[str, ...]:
    """Return the lines of a text as YAML counts them, without their ends."""
    return tuple(LINE_END.split(text.removesuffix("\n"))) if text else ()
