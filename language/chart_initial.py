"""Chart initial: the nodes of a chart while they are read, and at which of them each is entered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from language.chart import ROOT, Kind
from language.chart_target import inside
from language.document import Items, Node, Scalar, Table
from language.model import Mode
from language.problem import Span, nearest
from language.reader import Reader


@dataclass
class RawNode:
    """A node while it is read; indices are places in the list of all."""

    name: str
    path: str
    kind: Kind
    parent: int
    region: str
    is_region: bool
    span: Span
    table: Table
    mode: Mode | None = None
    children: list[int] = field(default_factory=list)
    number: int | None = None
    last: int = 0
    initial: tuple[int, ...] = ()


def set_initials(nodes: Sequence[RawNode], reader: Reader) -> None:
    """Find what `initial` names; a history without one has that of the mode around it."""
    for index, node in enumerate(nodes):
        if index != ROOT:
            node.initial = _initial(nodes, index, reader)
    for node in nodes:
        if node.kind == "history" and not node.initial:
            node.initial = nodes[node.parent].initial
        if node.kind == "history" and any(nodes[n].kind == "history" for n in node.initial):
            label = f"`{node.name}` goes to a history where nothing was left before"
            hint = "`initial` of a history names modes"
            reader.problems.error("target", node.span, label, hint)


def _initial(nodes: Sequence[RawNode], index: int, reader: Reader) -> tuple[int, ...]:
    raw = nodes[index]
    node = raw.table.get("initial")
    if raw.kind == "history":
        return _found(nodes, raw.parent, _words(node, raw, reader) if node else [], reader)
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
        told = f"like `initial: {nodes[own[0]].name}`"
        reader.problems.error("missing", raw.span, "`initial` is missing", told)
        return ()
    return _found(nodes, index, _words(node, raw, reader), reader)


def _found(
    nodes: Sequence[RawNode], owner: int, words: Sequence[Scalar], reader: Reader
) -> tuple[int, ...]:
    """Return the nodes that some words name inside another; those that are not there are told."""
    found = []
    for word in words:
        hit = inside(nodes, owner, word.text)
        if hit is None:
            label = f"there is no mode `{word.text}` in `{nodes[owner].name}`"
            names = [nodes[child].name for child in nodes[owner].children]
            reader.problems.error("name", word.span, label, nearest(word.text, names))
        else:
            found.append(hit)
    return tuple(found)


def _words(node: Node | None, raw: RawNode, reader: Reader) -> list[Scalar]:
    """Return the names that stand in a list, or the only one."""
    if isinstance(node, Items) and node.nodes:
        return reader.items(node, "initial")
    if isinstance(node, Items):
        reader.problems.error("missing", node.span, f"`initial` of `{raw.name}` names no mode")
        return []
    word = reader.scalar(node, "initial", raw.span)
    return [word] if word else []
