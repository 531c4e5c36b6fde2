"""XML parser: builds a tree of elements with their positions in the file.

A document type declaration may name an external file, which is not read. Documents that declare
entities are rejected, so that no entity can expand or refer to a file.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from language.text.diagnostic import Problems, Source, Span, SpecError

MAX_DEPTH = 64
"""Maximum depth of nested elements; a CDFX file of nested structures has about twenty."""


@dataclass(frozen=True)
class Element:
    """An XML element: tag without prefix, position, children, and pieces of its text."""

    tag: str
    span: Span
    children: list[Element] = field(default_factory=list)
    pieces: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """The text directly inside the element, without that of its children, stripped."""
        return "".join(self.pieces).strip()

    def find_all(self, tag: str) -> Iterator[Element]:
        """Return an iterator over the direct children with a tag."""
        return (child for child in self.children if child.tag == tag)

    def find(self, *path: str) -> Element | None:
        """Return the element at a path of tags below this one; None if there is none.

        Of several children with a tag the first is taken, without a search in the others. An empty
        path gives the element itself.
        """
        element: Element | None = self
        for tag in path:
            element = next(element.find_all(tag), None) if element else None
        return element

    def iter_descendants(self, tag: str) -> Iterator[Element]:
        """Yield all elements with a tag below this one, at any depth, in the order of the file."""
        for child in self.children:
            if child.tag == tag:
                yield child
            yield from child.iter_descendants(tag)


class _Builder:
    """The handlers of an expat parser that build the tree of a document."""

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
        """Return the current position of the parser."""
        at = self.parser.CurrentColumnNumber + 1
        return Span(self.source, self.parser.CurrentLineNumber, at, width)

    def start(self, name: str, attributes: object) -> None:
        """Open an element; rejects a document nested deeper than MAX_DEPTH."""
        element = Element(name.rpartition(":")[2], self.current_span(len(name) + 1))
        self.stack[-1].children.append(element)
        self.stack.append(element)
        if len(self.stack) > MAX_DEPTH:
            self.reject("depth", f"elements lie more than {MAX_DEPTH} deep in each other")

    def end(self, name: str) -> None:
        """Close the innermost element."""
        self.stack.pop()

    def text(self, data: str) -> None:
        """Add text to the innermost element."""
        self.stack[-1].pieces.append(data)

    def document_type(self, name: str, system: object, public: object, inside: int) -> None:
        """Reject a document type declaration with internal declarations."""
        if inside:
            self.reject("form", "a document that declares entities or elements is not read")

    def entity(self, *declared: object) -> None:
        """Reject an entity declaration."""
        self.reject("form", "a document that declares entities is not read")

    def skipped_entity(self, name: str, is_parameter: object) -> None:
        """Reject a reference to an unknown entity."""
        self.reject("form", f"the entity `{name}` is not known")

    def reject(self, kind: str, label: str) -> None:
        """Report a problem at the current position and raise SpecError."""
        self.problems.error(kind, self.current_span(), label)
        raise SpecError(self.problems.reported)


def parse_xml(source: Source, data: bytes) -> Element:
    """Return the root element of an XML document; tags are without their prefix.

    Raises SpecError for malformed XML, an unknown encoding, entity or element declarations,
    references to unknown entities, and more than MAX_DEPTH nested elements. An external document
    type is not read. `source` is for positions only.
    """
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
