"""XML tree: elements with their places; nothing is declared, fetched or expanded in it.

A document type may name a file of rules, which is not read. Entities that a document declares
itself are refused, so that none can grow or reach a file.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from language.problem import Problems, Source, Span, SpecError

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

    def all(self, tag: str) -> Iterator[Element]:
        """Iterate over the children with a tag."""
        return (child for child in self.children if child.tag == tag)

    def first(self, *path: str) -> Element | None:
        """Return what is found by going down a path of tags."""
        found: Element | None = self
        for tag in path:
            found = next(found.all(tag), None) if found else None
        return found

    def below(self, tag: str) -> Iterator[Element]:
        """Iterate over what is inside at any depth with a tag, in the order of the file."""
        for child in self.children:
            if child.tag == tag:
                yield child
            yield from child.below(tag)


class _Builder:
    """What is told of a document while it is read, as a tree."""

    def __init__(self, source: Source, parser: expat.XMLParserType) -> None:
        self.source, self.parser, self.problems = source, parser, Problems()
        self.open = [Element("", Span(source, 1, 1))]
        parser.StartElementHandler = self.start
        parser.EndElementHandler = self.end
        parser.CharacterDataHandler = self.text
        parser.StartDoctypeDeclHandler = self.document_type
        parser.EntityDeclHandler = self.entity
        parser.SkippedEntityHandler = self.skipped

    def place(self, width: int = 1) -> Span:
        at = self.parser.CurrentColumnNumber + 1
        return Span(self.source, self.parser.CurrentLineNumber, at, width)

    def start(self, name: str, attributes: object) -> None:
        element = Element(name.rpartition(":")[2], self.place(len(name) + 1))
        self.open[-1].children.append(element)
        self.open.append(element)
        if len(self.open) > MAX_DEPTH:
            self.refuse("depth", f"elements lie more than {MAX_DEPTH} deep in each other")

    def end(self, name: str) -> None:
        self.open.pop()

    def text(self, data: str) -> None:
        self.open[-1].pieces.append(data)

    def document_type(self, name: str, system: object, public: object, inside: int) -> None:
        if inside:
            self.refuse("form", "a document that declares entities or elements is not read")

    def entity(self, *declared: object) -> None:
        self.refuse("form", "a document that declares entities is not read")

    def skipped(self, name: str, is_parameter: object) -> None:
        self.refuse("form", f"the entity `{name}` is not known")

    def refuse(self, kind: str, label: str) -> None:
        self.problems.error(kind, self.place(), label)
        raise SpecError(self.problems.found)


def xml_tree(source: Source, data: bytes) -> Element:
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
    builder.problems.stop_if_any()
    return builder.open[0].children[0]
