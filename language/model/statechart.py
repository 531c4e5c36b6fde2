"""Statechart: the tree of nested modes of a chart, with its exit and entry sets.

The nodes are in the order of the file, each before its descendants. Of a node of kind `compound`
one child is active; of a `parallel` node all children are active, and these are regions. The
innermost nodes of a region have numbers, and the mode variable of the region holds the number of
the active one. Selection and entry follow W3C SCXML (2015, appendix D), whose terms are used here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

from language.text.diagnostic import Span

NodeKind = Literal["atomic", "compound", "parallel", "history"]
HistoryKind = Literal["", "shallow", "deep"]
TransitionOrder = Literal["outer_first", "inner_first"]
ROOT = 0
"""The index of the node that contains the regions of the root; it is never left."""


@dataclass(frozen=True)
class ChartNode:
    """A mode, region or history in the tree of a chart.

    `last_descendant` is the index of its last descendant, or its own. `path` is the dotted path
    from the root. `region` is the region whose mode variable shows that the node is active, and
    `number` the value of that variable; compound nodes and histories have none. `mode_key` is the
    key path of its Mode. `initial` are the indices of the nodes that are entered by default; for a
    history, those that are entered if nothing was active before. `priority` orders parallel
    regions.
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
        """Tell whether the node of the index `other` is this node or one of its descendants."""
        return self.index <= other <= self.last_descendant


@dataclass(frozen=True)
class ChartEvent:
    """An event: its number in the queue, whether an input raises it, and its place in the spec."""

    name: str
    number: int
    is_input: bool
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True)
class ChartTransition:
    """A transition in the tree: its source, its targets, and the node whose descendants it exits.

    `domain` is None for a transition without a target, which exits nothing.
    """

    source: int
    targets: tuple[int, ...]
    domain: int | None


@dataclass(frozen=True)
class Chart:
    """The tree of a chart with its events; `transitions` are by the key path of the transition."""

    nodes: tuple[ChartNode, ...]
    events: Mapping[str, ChartEvent]
    order: TransitionOrder
    micro_steps: int
    transitions: Mapping[str, ChartTransition]

    @cached_property
    def regions(self) -> tuple[ChartNode, ...]:
        """All regions in preorder; siblings are in ascending order of priority, then of index."""
        result: list[ChartNode] = []

        def visit(node: ChartNode) -> None:
            """Append the regions below a node."""
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
        """The numbered nodes of each region, by the name of the region."""
        result: dict[str, list[ChartNode]] = {region.region: [] for region in self.regions}
        for node in self.nodes:
            if node.number is not None:
                result[node.region].append(node)
        return {name: tuple(nodes) for name, nodes in result.items()}

    def leaves(self, region: str) -> tuple[ChartNode, ...]:
        """Return the numbered (innermost) nodes of the region of a name, in the order of the file.

        Raises KeyError for an unknown region.
        """
        return self._leaves[region]

    def leaves_of(self, node: ChartNode) -> tuple[ChartNode, ...]:
        """Return the innermost nodes of the node's region that are the node or its descendants.

        Those of regions inside the node are left out; they are in the order of the file.
        """
        return tuple(leaf for leaf in self.leaves(node.region) if node.contains(leaf.index))

    def region_node(self, name: str) -> ChartNode:
        """Return the node of the region of a name. Raises StopIteration for an unknown name."""
        return next(region for region in self.regions if region.region == name)

    def ancestors(self, node: ChartNode) -> Iterator[ChartNode]:
        """Yield a node, then its ancestors from the inside out; the root is left out."""
        while node.index != ROOT:
            yield node
            node = self.nodes[node.parent]

    def region_ancestors(self, leaf: ChartNode) -> tuple[ChartNode, ...]:
        """Return a node and its ancestors in its own region, from the inside out.

        The last node is that of the region itself; ancestors outside of it are left out.
        """
        return tuple(node for node in self.ancestors(leaf) if node.region == leaf.region)

    def child_regions(self, node: ChartNode) -> tuple[ChartNode, ...]:
        """Return the direct children of a node that are regions, in the order of the file.

        The result is empty for a node that is not parallel.
        """
        children = (self.nodes[child] for child in node.children)
        return tuple(child for child in children if child.is_region)

    def parent_region(self, region: ChartNode) -> ChartNode | None:
        """Return the innermost region around a region, or None for a region of the root."""
        parent = self.nodes[region.parent]
        return None if parent.index == ROOT else self.region_node(parent.region)

    def is_region_inside(self, region: ChartNode, other: ChartNode) -> bool:
        """Tell whether `region` is a descendant of `other`, at any depth and not `other` itself."""
        return region.index != other.index and other.contains(region.index)

    def domain(self, source: ChartNode, targets: Iterable[ChartNode], internal: bool) -> int | None:
        """Return the index of the innermost compound node that contains source and targets.

        This is the transition domain of SCXML; the transition exits its active descendants. The
        domain itself is neither the source nor a target, except that an internal transition to
        descendants of a compound source has the source as its domain. Returns None without targets,
        and ROOT if no compound node contains all of them.
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
        """Return the set of the domains (node indices) of transitions.

        Transitions without a target have none and are left out.
        """
        return frozenset(t.domain for t in transitions if t.domain is not None)

    def are_nested(self, left: int, right: int) -> bool:
        """Tell whether one of the nodes of two indices contains the other or they are the same."""
        return self.nodes[left].contains(right) or self.nodes[right].contains(left)

    def entry_set(self, node: ChartNode, targets: Iterable[int]) -> list[ChartNode]:
        """Return the nodes that an entry of `node` activates, `node` first, without any history.

        The nodes are in preorder. The indices `targets` below the node are entered instead of
        `initial`; others are ignored. A history gives its `initial` nodes and what lies between
        them and its parent, without the parent. All regions of a parallel node are entered.
        """
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
            histories = [w for w in targets if self.nodes[w].kind == "history"]
            defaults = [i for w in histories for i in self.nodes[w].initial]
            for region in self.child_regions(node):
                result += self.entry_set(region, [*targets, *defaults])
        return result

    def initial_configuration(self) -> list[ChartNode]:
        """Return the nodes that are active at the start: the entry sets of the regions of the root.

        The regions are in the order of `regions`.
        """
        regions = (node for node in self.regions if node.parent == ROOT)
        return [node for region in regions for node in self.entry_set(region, ())]

    def depth(self, node: ChartNode) -> int:
        """Return the number of nodes from below the root to a node: 1 for a region of the root.

        The root itself has 0.
        """
        return sum(1 for _ in self.ancestors(node))
