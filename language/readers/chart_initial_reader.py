"""Initial nodes of a chart: resolution of `initial` of superstates, regions and histories."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from language.model.automaton import Mode
from language.model.chart_paths import find_descendant
from language.model.statechart import ROOT, NodeKind
from language.readers.base_reader import Reader
from language.text.diagnostic import Span, suggest_name
from language.text.document import MappingNode, ScalarNode, SequenceNode, YamlNode


@dataclass
class RawNode:
    """A node of a chart while the chart is read.

    `parent`, `children`, `last` and `initial` are indices in the list of all nodes; `last` is the
    last descendant.
    """

    name: str
    path: str
    kind: NodeKind
    parent: int
    region: str
    is_region: bool
    span: Span
    table: MappingNode
    mode: Mode | None = None
    children: list[int] = field(default_factory=list)
    number: int | None = None
    last: int = 0
    initial: tuple[int, ...] = ()


def resolve_initials(nodes: Sequence[RawNode], reader: Reader) -> None:
    """Set `initial` of all nodes but the root to the node indices that their `initial` names.

    Names, also dotted, are searched below the node; those of a history below its parent. A compound
    node with a single child that is no history needs no `initial`. A history without `initial` gets
    that of its parent. Atomic and parallel nodes get ().

    Reported, not raised: a missing, empty or unknown `initial` (unknown names are left out), one of
    an atomic or parallel node, a compound node without modes, a history that leads to a history.
    """
    for index, node in enumerate(nodes):
        if index != ROOT:
            node.initial = _resolve_initial(nodes, index, reader)
    for node in nodes:
        if node.kind == "history" and not node.initial:
            node.initial = nodes[node.parent].initial
        if node.kind == "history" and any(nodes[n].kind == "history" for n in node.initial):
            label = f"`{node.name}` goes to a history where nothing was left before"
            hint = "`initial` of a history names modes"
            reader.problems.error("target", node.span, label, hint)


def _resolve_initial(nodes: Sequence[RawNode], index: int, reader: Reader) -> tuple[int, ...]:
    """Return the indices that `initial` of one node names; an empty tuple after a reported problem.

    A compound node with a single child needs no `initial`. A history is resolved among the children
    of its parent and may have none; atomic and parallel nodes must not have one.
    """
    raw = nodes[index]
    node = raw.table.get("initial")
    if raw.kind == "history":
        return _resolve_names(
            nodes, raw.parent, _read_initial_names(node, raw, reader) if node else [], reader
        )
    if raw.kind != "compound":
        if node is not None:
            label = f"`{raw.name}` has no modes inside: there is no `initial`"
            reader.problems.error("form", node.span, label)
        return ()
    own = [child for child in raw.children if nodes[child].kind != "history"]
    if not own:
        reader.problems.error("missing", raw.span, f"`{raw.name}` has no mode inside")
        return ()
    if node is None and len(own) == 1:
        return (own[0],)
    if node is None:
        hint = f"like `initial: {nodes[own[0]].name}`"
        reader.problems.error("missing", raw.span, "`initial` is missing", hint)
        return ()
    return _resolve_names(nodes, index, _read_initial_names(node, raw, reader), reader)


def _resolve_names(
    nodes: Sequence[RawNode], owner: int, words: Sequence[ScalarNode], reader: Reader
) -> tuple[int, ...]:
    """Return the descendants of `owner` that `words` name; a name without a node is reported."""
    indices = []
    for word in words:
        hit = find_descendant(nodes, owner, word.text)
        if hit is None:
            label = f"there is no mode `{word.text}` in `{nodes[owner].name}`"
            names = [nodes[child].name for child in nodes[owner].children]
            reader.problems.error("name", word.span, label, suggest_name(word.text, names))
        else:
            indices.append(hit)
    return tuple(indices)


def _read_initial_names(node: YamlNode | None, raw: RawNode, reader: Reader) -> list[ScalarNode]:
    """Return the names in `initial`: those of a list, or the only one.

    An empty list is reported.
    """
    if isinstance(node, SequenceNode) and node.nodes:
        return reader.read_list(node, "initial")
    if isinstance(node, SequenceNode):
        reader.problems.error("missing", node.span, f"`initial` of `{raw.name}` names no mode")
        return []
    word = reader.read_scalar(node, "initial", raw.span)
    return [word] if word else []
