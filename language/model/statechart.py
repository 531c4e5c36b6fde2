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

NodeKind = Literal["atomic", "compound", "parallel", "history"]
HistoryKind = Literal["", "shallow", "deep"]
TransitionOrder = Literal["outer_first", "inner_first"]
ROOT = 0
"""The node that holds the regions of the root; it is never left."""


@dataclass(frozen=True)
class ChartNode:
    """A mode or region in the tree; `last` is the last node inside it.

    `path` names it from the root, `region` is the region whose variable tells of it, `number` is
    what that holds. `mode` is the key path of its Mode. `initial` are the nodes that it is entered
    at; of a history those where nothing was left before. `rank` orders regions side by side.
    """

    index: int
    last_descendant: int
    name: str
    path: str
    kind: NodeKind
    parent: int
    children: tuple[int, ...]
    region: str
    is_region: bool
    mode_key: str
    number: int | None = None
    initial: tuple[int, ...] = ()
    history: HistoryKind = ""
    is_final: bool = False
    priority: int = 0

    def contains(self, other: int) -> bool:
        """Tell whether a node is this one or inside it."""
        return self.index <= other <= self.last_descendant


@dataclass(frozen=True)
class ChartEvent:
    """An event: its number in the queue, and whether it comes as an input."""

    name: str
    number: int
    is_input: bool


@dataclass(frozen=True)
class ChartTransition:
    """A transition in the tree: its source, targets, and the node whose inside it leaves.

    `domain` is None where nothing is left: the transition has no target.
    """

    source: int
    targets: tuple[int, ...]
    domain: int | None


@dataclass(frozen=True)
class Chart:
    """The tree of an automaton with its events; `ways` are by the key path of the transition."""

    nodes: tuple[ChartNode, ...]
    events: Mapping[str, ChartEvent]
    order: TransitionOrder
    micro_steps: int
    transitions: Mapping[str, ChartTransition]

    @cached_property
    def regions(self) -> tuple[ChartNode, ...]:
        """All regions, outer ones first; those side by side by their rank."""
        result: list[ChartNode] = []

        def visit(node: ChartNode) -> None:
            children = [self.nodes[child] for child in node.children]
            if node.kind == "parallel":
                children.sort(key=lambda child: (child.priority, child.index))
            for child in children:
                result.extend([child] if child.is_region else [])
                visit(child)

        visit(self.nodes[ROOT])
        return tuple(result)

    @cached_property
    def _leaves(self) -> Mapping[str, tuple[ChartNode, ...]]:
        result: dict[str, list[ChartNode]] = {region.region: [] for region in self.regions}
        for node in self.nodes:
            if node.number is not None:
                result[node.region].append(node)
        return {name: tuple(nodes) for name, nodes in result.items()}

    def leaves(self, region: str) -> tuple[ChartNode, ...]:
        """Return the innermost nodes of a region: its variable holds the number of one."""
        return self._leaves[region]

    def leaves_of(self, node: ChartNode) -> tuple[ChartNode, ...]:
        """Return the nodes of its own region that a node is active in."""
        return tuple(leaf for leaf in self.leaves(node.region) if node.contains(leaf.index))

    def region_node(self, name: str) -> ChartNode:
        """Return the node of a region."""
        return next(region for region in self.regions if region.region == name)

    def ancestors(self, node: ChartNode) -> Iterator[ChartNode]:
        """Yield a node and all that hold it, up to those of the root."""
        while node.index != ROOT:
            yield node
            node = self.nodes[node.parent]

    def region_ancestors(self, leaf: ChartNode) -> tuple[ChartNode, ...]:
        """Return a node and those that hold it, in its own region: the region itself is last."""
        return tuple(node for node in self.ancestors(leaf) if node.region == leaf.region)

    def child_regions(self, node: ChartNode) -> tuple[ChartNode, ...]:
        """Return the regions of a parallel node, none of another."""
        children = (self.nodes[child] for child in node.children)
        return tuple(child for child in children if child.is_region)

    def parent_region(self, region: ChartNode) -> ChartNode | None:
        """Return the region that a region stands in; None for one of the root."""
        parent = self.nodes[region.parent]
        return None if parent.index == ROOT else self.region_node(parent.region)

    def is_region_inside(self, region: ChartNode, other: ChartNode) -> bool:
        """Tell whether a region stands somewhere inside another."""
        return region.index != other.index and other.contains(region.index)

    def domain(self, source: ChartNode, targets: Iterable[ChartNode], internal: bool) -> int | None:
        """Return the innermost compound node around source and targets: its inside is left.

        An internal transition to what is inside its source does not leave that.
        """
        target_indices = [target.index for target in targets]
        if not target_indices:
            return None
        inside = source.kind == "compound" and all(
            source.contains(target) and target != source.index for target in target_indices
        )
        if internal and inside:
            return source.index
        for node in self.ancestors(source):
            is_around = node.index != source.index and node.kind == "compound"
            if is_around and all(node.contains(t) and t != node.index for t in target_indices):
                return node.index
        return ROOT

    def exited_domains(self, transitions: Iterable[ChartTransition]) -> frozenset[int]:
        """Return the domains of some transitions."""
        return frozenset(way.domain for way in transitions if way.domain is not None)

    def are_nested(self, left: int, right: int) -> bool:
        """Tell whether of two nodes one holds the other."""
        return self.nodes[left].contains(right) or self.nodes[right].contains(left)

    def entry_set(self, node: ChartNode, targets: Iterable[int]) -> list[ChartNode]:
        """Return the nodes that entering one enters, outer ones first, nothing remembered."""
        targets = [w for w in targets if node.contains(w) and w != node.index]
        if node.kind == "history":
            inside = [self.nodes[w] for w in node.initial]
            outer = self.nodes[node.parent]
            return self.entry_set(outer, [w.index for w in inside])[1:]
        result = [node]
        if node.kind == "compound":
            targets = targets or list(node.initial)
            child = next(c for c in node.children if self.nodes[c].contains(targets[0]))
            result += self.entry_set(self.nodes[child], targets)
        if node.kind == "parallel":
            kept = [w for w in targets if self.nodes[w].kind == "history"]
            more = [i for w in kept for i in self.nodes[w].initial]
            for region in self.child_regions(node):
                result += self.entry_set(region, [*targets, *more])
        return result

    def initial_configuration(self) -> list[ChartNode]:
        """Return the nodes that are active at the start."""
        regions = (node for node in self.regions if node.parent == ROOT)
        return [node for region in regions for node in self.entry_set(region, ())]

    def depth(self, node: ChartNode) -> int:
        """Return how many nodes hold a node."""
        return sum(1 for _ in self.ancestors(node))
