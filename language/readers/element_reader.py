"""Element reader: elements and places, to which effects are applied, and outputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, cast

from language.model.automaton import Element
from language.model.declaration import Formula
from language.readers.base_reader import TEXT_KEYS, Reader
from language.text.diagnostic import Problems, Span
from language.text.document import Entry, MappingNode, ScalarNode, SequenceNode, YamlNode
from language.text.overlay import without_keys

ELEMENT_KEYS = {
    "elastic": ("twist", "rate", "torque", "stiffness", "damping", "gap", "angle_rate"),
    "inertia": ("speed", "inertia", "far"),
}
"""Allowed keys of an element by its kind."""
REQUIRED_KEYS = {
    "elastic": ("twist", "rate", "torque", "stiffness"),
    "inertia": ("speed", "inertia"),
}
"""Required keys of an element by its kind."""
PLACE_KEYS = ("weight", "load", "brake", "angle_rate")
"""Keys that an entry of `places` may declare for a balance, input or output."""


@dataclass(frozen=True)
class OutputDeclarations:
    """The places of outputs in the file, and the variable that each output reads, by name."""

    spans: Mapping[str, Span]
    sources: Mapping[str, str]


class ElementReader(Reader):
    """Reads elements, places and outputs, which do not influence the dynamics."""

    def __init__(self, problems: Problems) -> None:
        """Report into `problems`."""
        super().__init__(problems)

    def read_elements(self, node: YamlNode | None) -> dict[str, Element]:
        """Return the elements by name in the order of the file; empty for an absent node.

        One with a missing or unknown `kind` is reported and left out. Keys that are not in
        ELEMENT_KEYS of the kind and missing REQUIRED_KEYS are reported, and the element is kept
        with the formulas that it has. `far` is a list of names with their places.
        """
        elements = {}
        for entry in self.named_entries(node, "elements"):
            key = f"elements.{entry.key}"
            table = self.read_mapping(entry.node, key)
            kind = self.read_choice(table.get("kind"), "kind", ELEMENT_KEYS, "")
            if not kind:
                if "kind" not in table.entries:
                    self.problems.error("missing", entry.span, f"`{key}.kind` is missing")
                continue
            table = self.read_mapping(table, key, ("kind", *ELEMENT_KEYS[kind]))
            for part in REQUIRED_KEYS[kind]:
                if part not in table.entries:
                    self.problems.error("missing", entry.span, f"`{key}.{part}` is missing")
            far = {item.text: item.span for item in self.read_list(table.get("far"), f"{key}.far")}
            parts = self.read_formulas(without_keys(table, "kind", "far", *TEXT_KEYS), key)
            element_kind = cast(Literal["elastic", "inertia"], kind)
            elements[entry.key] = Element(entry.key, element_kind, parts, far, key, entry.span)
        return elements

    def read_places(self, node: YamlNode | None) -> dict[str, Mapping[str, Formula]]:
        """Return the formulas that `places` declares, by state, input or output, then by key.

        Keys other than PLACE_KEYS, `about` and `req` are reported and left out. Whether the state,
        input or output exists is not checked.
        """
        places: dict[str, Mapping[str, Formula]] = {}
        for entry in self.named_entries(node, "places"):
            key = f"places.{entry.key}"
            table = self.read_mapping(entry.node, key, PLACE_KEYS)
            places[entry.key] = self.read_formulas(without_keys(table, *TEXT_KEYS), key)
        return places

    def read_outputs(self, node: YamlNode | None) -> OutputDeclarations:
        """Return the outputs of a list of names, or of a mapping from names to variables.

        A name of a list is both output and variable. An absent node gives no outputs. An entry that
        is no scalar is reported; in a mapping it reads the variable "". Whether variables exist is
        not checked.
        """
        if not isinstance(node, MappingNode):
            items = self.read_list(node, "outputs")
            return OutputDeclarations(
                {i.text: i.span for i in items}, {i.text: i.text for i in items}
            )
        spans: dict[str, Span] = {}
        sources: dict[str, str] = {}
        for entry in self.named_entries(node, "outputs"):
            spans[entry.key] = entry.node.span
            sources[entry.key] = self.read_string(entry.node, f"outputs.{entry.key}", entry.span)
        return OutputDeclarations(spans, sources)


def outputs_as_mapping(node: YamlNode) -> MappingNode:
    """Return `outputs` as a mapping from each output to the variable that it reads.

    A mapping is returned unchanged; each scalar of a list maps to itself, other items are left out.
    Any other node gives an empty mapping. Nothing is reported.
    """
    if isinstance(node, MappingNode):
        return node
    nodes = node.nodes if isinstance(node, SequenceNode) else ()
    items = [item for item in nodes if isinstance(item, ScalarNode)]
    return MappingNode({item.text: Entry(item.text, item.span, item) for item in items}, node.span)
