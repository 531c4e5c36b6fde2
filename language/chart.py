"""Chart: modes inside modes as a tree - what is active together, what a transition leaves.

The nodes stand in the order of the file, each before those inside it. A node of kind `compound` is
in one of its children, a `parallel` one in all of them: these are regions. The innermost nodes of
a region have numbers; its variable holds that of the active one. The words are those of W3C's
SCXML (2015, appendix D), whose selection and entry these charts follow.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

Kind = Literal["atomic", "compound", "parallel", "history"]
Keeping = Literal["", "shallow", "deep"]
Order = Literal["outer_first", "inner_first"]
ROOT = 0
"""The node that holds the regions of the root; it is never left."""


@dataclass(frozen=True)
class Node:
    """A mode or region in the tree; `last` is the last node inside it.

    `path` names it from the root, `region` is the region whose variable tells of it, `number` is
    what that holds. `mode` is the key path of its Mode. `initial` are the nodes that it is entered
    at; of a history those where nothing was left before. `rank` orders regions side by side.
    """

    index: int
    last: int
    name: str
    path: str
    kind: Kind
    parent: int
    children: tuple[int, ...]
    region: str
    is_region: bool
    mode: str
    number: int | None = None
    initial: tuple[int, ...] = ()
    history: Keeping = ""
    final: bool = False
    rank: int = 0

    def holds(self, other: int) -> bool:
        """Tell whether a node is this one or inside it."""
        return self.index <= other <= self.last


@dataclass(frozen=True)
class Signal:
    """An event: its number in the queue, and whether it comes as an input."""

    name: str
    number: int
    is_input: bool


@dataclass(frozen=True)
class Way:
    """A transition in the tree: its source, targets, and the node whose inside it leaves.

    `domain` is None where nothing is left: the transition has no target.
    """

    source: int
    targets: tuple[int, ...]
    domain: int | None


@dataclass(frozen=True)
class Chart:
    """The tree of an automaton with its events; `ways` are by the key path of the transition."""

    nodes: tuple[Node, ...]
    signals: Mapping[str, Signal]
    order: Order
    micro_steps: int
    ways: Mapping[str, Way]

    @cached_property
    def regions(self) -> tuple[Node, ...]:
        """All regions, outer ones first; those side by side by their rank."""
        found: list[Node] = []

        def visit(node: Node) -> None:
            children = [self.nodes[child] for child in node.children]
            if node.kind == "parallel":
                children.sort(key=lambda child: (child.rank, child.index))
            for child in children:
                found.extend([child] if child.is_region else [])
                visit(child)

        visit(self.nodes[ROOT])
        return tuple(found)

    @cached_property
    def _leaves(self) -> Mapping[str, tuple[Node, ...]]:
        found: dict[str, list[Node]] = {region.region: [] for region in self.regions}
        for node in self.nodes:
            if node.number is not None:
                found[node.region].append(node)
        return {name: tuple(nodes) for name, nodes in found.items()}

    def leaves(self, region: str) -> tuple[Node, ...]:
        """Return the innermost nodes of a region: its variable holds the number of one."""
        return self._leaves[region]

    def leaves_of(self, node: Node) -> tuple[Node, ...]:
        """Return the nodes of its own region that a node is active in."""
        return tuple(leaf for leaf in self.leaves(node.region) if node.holds(leaf.index))

    def region_node(self, name: str) -> Node:
        """Return the node of a region."""
        return next(region for region in self.regions if region.region == name)

    def outer(self, node: Node) -> Iterator[Node]:
        """Yield a node and all that hold it, up to those of the root."""
        while node.index != ROOT:
            yield node
            node = self.nodes[node.parent]

    def chain(self, leaf: Node) -> tuple[Node, ...]:
        """Return a node and those that hold it, in its own region: the region itself is last."""
        return tuple(node for node in self.outer(leaf) if node.region == leaf.region)

    def inner_regions(self, node: Node) -> tuple[Node, ...]:
        """Return the regions of a parallel node, none of another."""
        children = (self.nodes[child] for child in node.children)
        return tuple(child for child in children if child.is_region)

    def outer_region(self, region: Node) -> Node | None:
        """Return the region that a region stands in; None for one of the root."""
        parent = self.nodes[region.parent]
        return None if parent.index == ROOT else self.region_node(parent.region)

    def is_inside(self, region: Node, other: Node) -> bool:
        """Tell whether a region stands somewhere inside another."""
        return region.index != other.index and other.holds(region.index)

    def domain(self, source: Node, targets: Iterable[Node], internal: bool) -> int | None:
        """Return the innermost compound node around source and targets: its inside is left.

        An internal transition to what is inside its source does not leave that.
        """
        wanted = [target.index for target in targets]
        if not wanted:
            return None
        inside = source.kind == "compound" and all(
            source.holds(target) and target != source.index for target in wanted
        )
        if internal and inside:
            return source.index
        for node in self.outer(source):
            is_around = node.index != source.index and node.kind == "compound"
            if is_around and all(node.holds(t) and t != node.index for t in wanted):
                return node.index
        return ROOT

    def reach(self, ways: Iterable[Way]) -> frozenset[int]:
        """Return the domains of some transitions."""
        return frozenset(way.domain for way in ways if way.domain is not None)

    def nested(self, left: int, right: int) -> bool:
        """Tell whether of two nodes one holds the other."""
        return self.nodes[left].holds(right) or self.nodes[right].holds(left)

    def first(self, node: Node, wanted: Iterable[int]) -> list[Node]:
        """Return the nodes that entering one enters, outer ones first, nothing remembered."""
        wanted = [w for w in wanted if node.holds(w) and w != node.index]
        if node.kind == "history":
            inside = [self.nodes[w] for w in node.initial]
            outer = self.nodes[node.parent]
            return self.first(outer, [w.index for w in inside])[1:]
        found = [node]
        if node.kind == "compound":
            wanted = wanted or list(node.initial)
            child = next(c for c in node.children if self.nodes[c].holds(wanted[0]))
            found += self.first(self.nodes[child], wanted)
        if node.kind == "parallel":
            kept = [w for w in wanted if self.nodes[w].kind == "history"]
            more = [i for w in kept for i in self.nodes[w].initial]
            for region in self.inner_regions(node):
                found += self.first(region, [*wanted, *more])
        return found

    def started(self) -> list[Node]:
        """Return the nodes that are active at the start."""
        regions = (node for node in self.regions if node.parent == ROOT)
        return [node for region in regions for node in self.first(region, ())]

    def depth(self, node: Node) -> int:
        """Return how many nodes hold a node."""
        return sum(1 for _ in self.outer(node))
