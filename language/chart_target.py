"""Chart target: what the name of a mode means where it stands in a chart.

A name is looked for among the siblings of the transition's mode, then among those of its parents,
at last among the modes inside it; a dotted path from the root is always exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from language.chart import ROOT, Chart, Node
from language.model import CHART


class Inner(Protocol):
    """What is needed of a node to look inside it."""

    @property
    def name(self) -> str:
        """Its own name."""

    @property
    def children(self) -> Sequence[int]:
        """The places of those inside it."""


def inside(nodes: Sequence[Inner], owner: int, path: str) -> int | None:
    """Return the node that a path names from one that holds it."""
    for part in path.split("."):
        found = [child for child in nodes[owner].children if nodes[child].name == part]
        if not found:
            return None
        owner = found[0]
    return owner


def looked_up(chart: Chart, source: Node, name: str) -> Node | None:
    """Return the node that a transition of another names."""
    first, _, rest = name.partition(".")
    if rest:
        for start in (name, f"{CHART}.{name}"):
            found = inside(chart.nodes, ROOT, start)
            if found is not None:
                return chart.nodes[found]
    owners = [chart.nodes[node.parent] for node in chart.outer(source)]
    for owner in (*owners, source):
        begun = inside(chart.nodes, owner.index, first)
        if begun is not None:
            found = inside(chart.nodes, begun, rest) if rest else begun
            if found is not None:
                return chart.nodes[found]
    return None


def known_targets(chart: Chart) -> list[str]:
    """Return the names by which modes can be targets."""
    nodes = [node for node in chart.nodes if node.index != ROOT]
    return [*(node.name for node in nodes), *(node.path for node in nodes)]


def mode_paths(chart: Chart) -> dict[str, Node]:
    """Return the names by which `in(...)` asks for modes: of the chart with it and without."""
    found: dict[str, Node] = {}
    for node in chart.nodes:
        if node.index != ROOT and node.kind != "history":
            found[node.path] = node
            if chart.nodes[node.parent].index != ROOT and _is_of_chart(chart, node):
                found[f"{CHART}.{node.path}"] = node
    return found


def fault_modes(chart: Chart) -> dict[str, Node]:
    """Return the modes that a fault may enter: those of the chart, of none of its regions."""
    return {name: node for name, node in mode_paths(chart).items() if node.region == CHART}


def _is_of_chart(chart: Chart, node: Node) -> bool:
    *_, region = chart.outer(node)
    return region.name == CHART
