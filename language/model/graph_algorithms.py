"""Graph algorithms: topological order, depth-first post-order, cycles, components, reachability.

The algorithms are those of networkx. Its import takes longer than the check of a small spec, so a
small graph is ordered here by the definition of the order, which takes quadratic time, and networkx
is imported for a large graph or for a cycle that is reported. Both give the same result.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

Edges = Mapping[str, Iterable[str]]
"""The successors of each node; every node is a key, in the order that breaks ties."""

MAX_SMALL_GRAPH = 200
"""Largest number of nodes of a small graph: its order takes less than 5 ms, the import 150 ms."""


def topological_sort(edges: Edges) -> list[str] | None:
    """Return the nodes with each node before its successors; None if the graph has a cycle.

    Of the nodes that may come next, the first in the order of the keys comes first (Kahn 1962).
    Successors that are no keys are left out. A node that leads to itself is a cycle.
    """
    if len(edges) > MAX_SMALL_GRAPH:
        import networkx

        position = {name: index for index, name in enumerate(edges)}
        try:
            return list(
                networkx.lexicographical_topological_sort(_digraph(edges), key=position.__getitem__)
            )
        except networkx.NetworkXUnfeasible:
            return None
    predecessors = {name: set(sources) for name, sources in reversed_edges(edges).items()}
    order: dict[str, None] = {}
    while len(order) < len(predecessors):
        ready = (
            n for n, before in predecessors.items() if n not in order and before <= order.keys()
        )
        name = next(ready, None)
        if name is None:
            return None
        order[name] = None
    return list(order)


def post_order(edges: Edges) -> list[str]:
    """Return the nodes in depth-first post-order: each after its successors, except in a cycle.

    The search starts from the nodes in the order of the keys and follows successors in their order.
    Successors that are no keys are left out.
    """
    if len(edges) > MAX_SMALL_GRAPH:
        import networkx

        return list(networkx.dfs_postorder_nodes(_digraph(edges)))
    order: list[str] = []
    visited: set[str] = set()

    def visit(name: str) -> None:
        if name in edges and name not in visited:
            visited.add(name)
            for successor in edges[name]:
                visit(successor)
            order.append(name)

    for name in edges:
        visit(name)
    return order


def find_cycle(edges: Edges) -> list[str]:
    """Return the nodes of the first cycle of a depth-first search, in the order of its edges.

    The last node leads to the first one. The search starts from the nodes in the order of the keys.
    The list is empty if the graph has no cycle.
    """
    if len(edges) <= MAX_SMALL_GRAPH and topological_sort(edges) is not None:
        return []
    import networkx

    try:
        return [source for source, _ in networkx.find_cycle(_digraph(edges))]
    except networkx.NetworkXNoCycle:
        return []


def strongly_connected_components(edges: Edges) -> list[list[str]]:
    """Return the strongly connected components, each after the components that it leads to.

    Each node is in one component, alone if it is in no cycle. The nodes of a component are in the
    order of the keys.
    """
    position = {name: index for index, name in enumerate(edges)}
    if len(edges) > MAX_SMALL_GRAPH:
        import networkx

        found = networkx.strongly_connected_components(_digraph(edges))
        return [sorted(component, key=position.__getitem__) for component in found]
    reached = {name: reachable(edges, name) for name in edges}
    components: dict[str, list[str]] = {}
    for name in reversed(post_order(edges)):
        root = next((r for r in components if name in reached[r] and r in reached[name]), name)
        components.setdefault(root, []).append(name)
    return [sorted(c, key=position.__getitem__) for c in reversed(list(components.values()))]


def reachable(edges: Edges, start: str) -> set[str]:
    """Return the nodes that a path from `start` reaches, `start` included.

    A node that is no key has no successors, but is reached.
    """
    nodes, pending = {start}, [start]
    while pending:
        new = set(edges.get(pending.pop(), ())) - nodes
        nodes |= new
        pending += new
    return nodes


def reversed_edges(edges: Edges) -> dict[str, list[str]]:
    """Return the predecessors of each node; successors that are no keys are left out.

    Nodes and predecessors are in the order of the keys; a repeated successor gives a repeated
    predecessor.
    """
    predecessors: dict[str, list[str]] = {name: [] for name in edges}
    for name, successors in edges.items():
        for successor in successors:
            if successor in predecessors:
                predecessors[successor].append(name)
    return predecessors


def format_cycle(cycle: Sequence[str]) -> str:
    """Return a cycle as text, back to its first node: "`a` -> `b` -> `a`".

    Raises IndexError for an empty cycle.
    """
    return " -> ".join(f"`{name}`" for name in [*cycle, cycle[0]])


def _digraph(edges: Edges) -> Any:
    """Return the graph of the keys as a networkx DiGraph; its nodes keep their order."""
    import networkx

    graph = networkx.DiGraph()
    graph.add_nodes_from(edges)
    graph.add_edges_from(
        (name, successor)
        for name, successors in edges.items()
        for successor in successors
        if successor in edges
    )
    return graph
