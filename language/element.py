"""Element reader: what effects are laid on - elements, places, and what the outputs read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, cast

from language.declaration import Formula
from language.document import Entry, Items, Node, Scalar, Table
from language.model import Element
from language.overlay import without
from language.problem import Problems, Span
from language.reader import TEXT_KEYS, Reader

ELEMENT_KEYS = {
    "elastic": ("twist", "rate", "torque", "stiffness", "damping", "gap", "angle_rate"),
    "inertia": ("speed", "inertia", "far"),
}
"""Keys of an element by its kind; the first ones of each have to be there."""
REQUIRED = {"elastic": ("twist", "rate", "torque", "stiffness"), "inertia": ("speed", "inertia")}
PLACE_KEYS = ("weight", "load", "brake", "angle_rate")
"""What a balance, input or output may say about itself for effects."""


@dataclass(frozen=True)
class Outputs:
    """The outputs by name: where each stands, and what it reads."""

    spans: Mapping[str, Span]
    sources: Mapping[str, str]


class ElementReader(Reader):
    """Reads the sections that have no influence on the dynamics."""

    def __init__(self, problems: Problems) -> None:
        """Report into `problems`."""
        super().__init__(problems)

    def elements(self, node: Node | None) -> dict[str, Element]:
        """Return the elements by name."""
        found = {}
        for entry in self.named(node, "elements"):
            key = f"elements.{entry.key}"
            table = self.table(entry.node, key)
            kind = self.choice(table.get("kind"), "kind", ELEMENT_KEYS, "")
            if not kind:
                if "kind" not in table.entries:
                    self.problems.error("missing", entry.span, f"`{key}.kind` is missing")
                continue
            table = self.table(table, key, ("kind", *ELEMENT_KEYS[kind]))
            for part in REQUIRED[kind]:
                if part not in table.entries:
                    self.problems.error("missing", entry.span, f"`{key}.{part}` is missing")
            far = {item.text: item.span for item in self.items(table.get("far"), f"{key}.far")}
            parts = self.formulas(without(table, "kind", "far", *TEXT_KEYS), key)
            element = cast(Literal["elastic", "inertia"], kind)
            found[entry.key] = Element(entry.key, element, parts, far, key, entry.span)
        return found

    def places(self, node: Node | None) -> dict[str, Mapping[str, Formula]]:
        """Return what places say about themselves, by the name of a state, input or output."""
        found: dict[str, Mapping[str, Formula]] = {}
        for entry in self.named(node, "places"):
            key = f"places.{entry.key}"
            table = self.table(entry.node, key, PLACE_KEYS)
            found[entry.key] = self.formulas(without(table, *TEXT_KEYS), key)
        return found

    def outputs(self, node: Node | None) -> Outputs:
        """Return the outputs: a list of names, or a mapping from names to what they read."""
        if not isinstance(node, Table):
            items = self.items(node, "outputs")
            return Outputs({i.text: i.span for i in items}, {i.text: i.text for i in items})
        spans: dict[str, Span] = {}
        sources: dict[str, str] = {}
        for entry in self.named(node, "outputs"):
            spans[entry.key] = entry.node.span
            sources[entry.key] = self.text(entry.node, f"outputs.{entry.key}", entry.span)
        return Outputs(spans, sources)


def outputs_as_mapping(node: Node) -> Table:
    """Return the outputs of a tree as a mapping, whether they are a list or one already."""
    if isinstance(node, Table):
        return node
    nodes = node.nodes if isinstance(node, Items) else ()
    items = [item for item in nodes if isinstance(item, Scalar)]
    return Table({item.text: Entry(item.text, item.span, item) for item in items}, node.span)
