"""XML tree: elements with their places; nothing is declared, fetched or expanded in it.

A document type may name a file of rules, which is not read. Entities that a document declares
itself are refused, so that none can grow or reach a file.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from language.text.diagnostic import Problems, Source, Span, SpecError

MAX_DEPTH = 64
"""Deepest nesting: a CDFX file of a structure in a structure has some twenty."""


@dataclass(frozen=True)
class Element:
    """An element: its tag without a prefix, its own text, and what it holds."""

    tag: str
    span: Span
    children: list[Element] = field(default_factory=list)
    pieces: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """The text between its tags, without blanks around it."""
        return "".join(self.pieces).strip()

    def find_all(self, tag: str) -> Iterator[Element]:
        """Iterate over the children with a tag."""
        return (child for child in self.children if child.tag == tag)

    def find(self, *path: str) -> Element | None:
        """Return what is found by going down a path of tags."""
        element: Element | None = self
        for tag in path:
            element = next(element.find_all(tag), None) if element else None
        return element

    def iter_descendants(self, tag: str) -> Iterator[Element]:
        """Iterate over what is inside at any depth with a tag, in the order of the file."""
        for child in self.children:
            if child.tag == tag:
                yield child
            yield from child.iter_descendants(tag)


class _Builder:
    """What is told of a document while it is read, as a tree."""

    def __init__(self, source: Source, parser: expat.XMLParserType) -> None:
        self.source, self.parser, self.problems = source, parser, Problems()
        self.stack = [Element("", Span(source, 1, 1))]
        parser.StartElementHandler = self.start
        parser.EndElementHandler = self.end
        parser.CharacterDataHandler = self.text
        parser.StartDoctypeDeclHandler = self.document_type
        parser.EntityDeclHandler = self.entity
        parser.SkippedEntityHandler = self.skipped_entity

    def current_span(self, width: int = 1) -> Span:
        at = self.parser.CurrentColumnNumber + 1
        return Span(self.source, self.parser.CurrentLineNumber, at, width)

    def start(self, name: str, attributes: object) -> None:
        element = Element(name.rpartition(":")[2], self.current_span(len(name) + 1))
        self.stack[-1].children.append(element)
        self.stack.append(element)
        if len(self.stack) > MAX_DEPTH:
            self.reject("depth", f"elements lie more than {MAX_DEPTH} deep in each other")

    def end(self, name: str) -> None:
        self.stack.pop()

    def text(self, data: str) -> None:
        self.stack[-1].pieces.append(data)

    def document_type(self, name: str, system: object, public: object, inside: int) -> None:
        if inside:
            self.reject("form", "a document that declares entities or elements is not read")

    def entity(self, *declared: object) -> None:
        self.reject("form", "a document that declares entities is not read")

    def skipped_entity(self, name: str, is_parameter: object) -> None:
        self.reject("form", f"the entity `{name}` is not known")

    def reject(self, kind: str, label: str) -> None:
        self.problems.error(kind, self.current_span(), label)
        raise SpecError(self.problems.reported)


def parse_xml(source: Source, data: bytes) -> Element:
    """Return the root of an XML document. Raises SpecError."""
    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)
    builder = _Builder(source, parser)
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        place = Span(source, error.lineno, error.offset + 1)
        builder.problems.error("form", place, f"this is not XML: {expat.ErrorString(error.code)}")
    except (LookupError, ValueError):
        start = Span(source, 1, 1)
        builder.problems.error("binary", start, "the encoding of this XML is not known")
    builder.problems.raise_if_errors()
    return builder.stack[0].children[0]
