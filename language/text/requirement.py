"""Requirements: the names of requirements that parts of a spec claim to fulfil, `req: [BL-3]`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from language.text.diagnostic import Span
from language.text.document import MappingNode, ScalarNode, SequenceNode, YamlNode


@dataclass(frozen=True)
class RequirementUse:
    """A reference to a requirement: name, key path (empty for the whole file) and span."""

    requirement: str
    path: str
    span: Span


def requirements_of(mapping: MappingNode) -> tuple[str, ...]:
    """Return the names under the key `req` of a mapping, a scalar or a sequence, in their order.

    Empty texts and items that are not scalars are left out; repetitions stay. Mappings below are
    not searched. Without the key the result is empty.
    """
    return tuple(item.text for item in _requirement_scalars(mapping))


def find_requirements(node: YamlNode, path: tuple[str, ...] = ()) -> Iterator[RequirementUse]:
    """Yield every reference to a requirement in a tree: those of a mapping, then those below it.

    Mappings inside sequences are not searched. `path` has the keys from the root to `node`; the
    path of a use is the keys to its mapping, joined with `.`.
    """
    if not isinstance(node, MappingNode):
        return
    for item in _requirement_scalars(node):
        yield RequirementUse(item.text, ".".join(path), item.span)
    for entry in node:
        yield from find_requirements(entry.node, (*path, entry.key))


def all_requirements(*trees: MappingNode) -> tuple[str, ...]:
    """Return the requirements named in the trees, each once, in order of first occurrence.

    All mappings that `find_requirements` searches count, tree by tree.
    """
    return tuple(dict.fromkeys(each.requirement for t in trees for each in find_requirements(t)))


def _requirement_scalars(table: MappingNode) -> Iterator[ScalarNode]:
    """Yield the scalars under `req` of a mapping that are not empty."""
    node = table.get("req")
    nodes = node.nodes if isinstance(node, SequenceNode) else (node,)
    yield from (each for each in nodes if isinstance(each, ScalarNode) and each.text)
