"""Chart paths: resolution of the names of modes in a chart.

A name is searched among the siblings of the source mode of the transition, then among the siblings
of each ancestor, and last among the children of the source. A dotted path from the root is exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from language.ir.root_region import CHART
from language.model.statechart import ROOT, Chart, ChartNode


class NamedNode(Protocol):
    """The attributes of a tree node that a search by path needs."""

    @property
    def name(self) -> str:
        """The name of the node, without those of its ancestors."""

    @property
    def children(self) -> Sequence[int]:
        """The indices of the child nodes."""


def find_descendant(nodes: Sequence[NamedNode], owner: int, path: str) -> int | None:
    """Return the index of the node at a dotted path below the node `owner`, or None.

    Each part of the path is the name of a child; of equal names the first child counts.
    """
    for part in path.split("."):
        matches = [child for child in nodes[owner].children if nodes[child].name == part]
        if not matches:
            return None
        owner = matches[0]
    return owner


def resolve_target(chart: Chart, source: ChartNode, name: str) -> ChartNode | None:
    """Return the node that the target `name` of a transition of `source` denotes, or None.

    A dotted name is first tried as a path from the root, without and with the prefix `chart.`.
    Otherwise the first part of the name is searched among the children of each ancestor of
    `source`, from the inside out, then among the children of `source`; the remaining parts are
    resolved below the hit.
    """
    first, _, rest = name.partition(".")
    if rest:
        for path in (name, f"{CHART}.{name}"):
            index = find_descendant(chart.nodes, ROOT, path)
            if index is not None:
                return chart.nodes[index]
    owners = [chart.nodes[node.parent] for node in chart.ancestors(source)]
    for owner in (*owners, source):
        first_node = find_descendant(chart.nodes, owner.index, first)
        if first_node is not None:
            index = find_descendant(chart.nodes, first_node, rest) if rest else first_node
            if index is not None:
                return chart.nodes[index]
    return None


def target_names(chart: Chart) -> list[str]:
    """Return the names that `to` may contain: the short names of all nodes, then all paths.

    Regions and histories are included, the root is not. Names are in the order of the file, with
    repetitions.
    """
    nodes = [node for node in chart.nodes if node.index != ROOT]
    return [*(node.name for node in nodes), *(node.path for node in nodes)]


def mode_paths(chart: Chart) -> dict[str, ChartNode]:
    """Return the nodes that `in(...)` may name, by path: modes and regions, but no histories.

    A node inside the root region `chart` is listed with and without the prefix `chart.`.
    """
    paths: dict[str, ChartNode] = {}
    for node in chart.nodes:
        if node.index != ROOT and node.kind != "history":
            paths[node.path] = node
            if chart.nodes[node.parent].index != ROOT and _is_in_root_region(chart, node):
                paths[f"{CHART}.{node.path}"] = node
    return paths


def fault_modes(chart: Chart) -> dict[str, ChartNode]:
    """Return the nodes that `fault_mode` may name, by path: nodes whose region is `chart`.

    They are those of `mode_paths`, with its two paths of a nested node. Modes that contain others
    and the region itself are included; modes in regions inside a mode are not.
    """
    return {name: node for name, node in mode_paths(chart).items() if node.region == CHART}


def _is_in_root_region(chart: Chart, node: ChartNode) -> bool:
    """Tell whether the outermost ancestor of a node is the region `chart`."""
    *_, region = chart.ancestors(node)
    return region.name == CHART
