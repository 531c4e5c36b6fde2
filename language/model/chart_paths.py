"""Chart target: what the name of a mode means where it stands in a chart.

A name is looked for among the siblings of the transition's mode, then among those of its parents,
at last among the modes inside it; a dotted path from the root is always exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from language.ir.regions import CHART
from language.model.statechart import ROOT, Chart, ChartNode


class NamedNode(Protocol):
    """What is needed of a node to look inside it."""

    @property
    def name(self) -> str:
        """Its own name."""

    @property
    def children(self) -> Sequence[int]:
        """The places of those inside it."""


def find_descendant(nodes: Sequence[NamedNode], owner: int, path: str) -> int | None:
    """Return the node that a path names from one that holds it."""
    for part in path.split("."):
        found = [child for child in nodes[owner].children if nodes[child].name == part]
        if not found:
            return None
        owner = found[0]
    return owner


def resolve_target(chart: Chart, source: ChartNode, name: str) -> ChartNode | None:
    """Return the node that a transition of another names."""
    first, _, rest = name.partition(".")
    if rest:
        for start in (name, f"{CHART}.{name}"):
            found = find_descendant(chart.nodes, ROOT, start)
            if found is not None:
                return chart.nodes[found]
    owners = [chart.nodes[node.parent] for node in chart.ancestors(source)]
    for owner in (*owners, source):
        first_node = find_descendant(chart.nodes, owner.index, first)
        if first_node is not None:
            found = find_descendant(chart.nodes, first_node, rest) if rest else first_node
            if found is not None:
                return chart.nodes[found]
    return None


def target_names(chart: Chart) -> list[str]:
    """Return the names by which modes can be targets."""
    nodes = [node for node in chart.nodes if node.index != ROOT]
    return [*(node.name for node in nodes), *(node.path for node in nodes)]


def mode_paths(chart: Chart) -> dict[str, ChartNode]:
    """Return the names by which `in(...)` asks for modes: of the chart with it and without."""
    paths: dict[str, ChartNode] = {}
    for node in chart.nodes:
        if node.index != ROOT and node.kind != "history":
            paths[node.path] = node
            if chart.nodes[node.parent].index != ROOT and _is_in_root_region(chart, node):
                paths[f"{CHART}.{node.path}"] = node
    return paths


def fault_modes(chart: Chart) -> dict[str, ChartNode]:
    """Return the modes that a fault may enter: those of the chart, of none of its regions."""
    return {name: node for name, node in mode_paths(chart).items() if node.region == CHART}


def _is_in_root_region(chart: Chart, node: ChartNode) -> bool:
    *_, region = chart.ancestors(node)
    return region.name == CHART
