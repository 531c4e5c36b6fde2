"""Requirement: names of requirements that something of a spec fulfils, `req: [BL-3]`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from language.text.diagnostic import Span
from language.text.document import MappingNode, ScalarNode, SequenceNode, YamlNode


@dataclass(frozen=True)
class RequirementUse:
    """A requirement named at a key path, empty for the whole file."""

    requirement: str
    path: str
    span: Span


def requirements_of(table: MappingNode) -> tuple[str, ...]:
    """Return the names under `req`: one, or a list."""
    return tuple(item.text for item in _requirement_scalars(table))


def find_requirements(node: YamlNode, path: tuple[str, ...] = ()) -> Iterator[RequirementUse]:
    """Yield every requirement that is named in a tree, in the order of the file."""
    if not isinstance(node, MappingNode):
        return
    for item in _requirement_scalars(node):
        yield RequirementUse(item.text, ".".join(path), item.span)
    for entry in node:
        yield from find_requirements(entry.node, (*path, entry.key))


def all_requirements(*trees: MappingNode) -> tuple[str, ...]:
    """Return the requirements that are named in trees, each once."""
    return tuple(dict.fromkeys(each.requirement for t in trees for each in find_requirements(t)))


def _requirement_scalars(table: MappingNode) -> Iterator[ScalarNode]:
    node = table.get("req")
    nodes = node.nodes if isinstance(node, SequenceNode) else (node,)
    yield from (each for each in nodes if isinstance(each, ScalarNode) and each.text)
