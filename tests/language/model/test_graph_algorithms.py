"""Small graphs, which are ordered by definition, and large ones, which networkx orders."""

from __future__ import annotations

import subprocess
import sys

import networkx
import pytest
from hypothesis import given, strategies as st

from language.model import graph_algorithms as graphs
from language.model.graph_algorithms import Edges

NAMES = [f"n{number}" for number in range(9)]
ORDERS = (graphs.topological_sort, graphs.post_order, graphs.strongly_connected_components)


@st.composite
def edge_maps(draw: st.DrawFn) -> dict[str, list[str]]:
    names = draw(st.permutations(NAMES))[: draw(st.integers(0, len(NAMES)))]
    successors = st.lists(st.sampled_from(names), unique=True, max_size=4) if names else st.just([])
    return {name: draw(successors) for name in names}


@given(edge_maps())
def test_small_and_large_graphs_have_the_same_orders(edges: dict[str, list[str]]) -> None:
    small = [order(edges) for order in ORDERS]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(graphs, "MAX_SMALL_GRAPH", -1)
        assert [order(edges) for order in ORDERS] == small


@given(edge_maps())
def test_orders_have_the_properties_of_their_definitions(edges: dict[str, list[str]]) -> None:
    graph = networkx.DiGraph(edges)
    order = graphs.topological_sort(edges)
    assert (order is None) == (not networkx.is_directed_acyclic_graph(graph))
    if order is not None:
        assert all(order.index(a) < order.index(b) for a in edges for b in edges[a])
        assert graphs.find_cycle(edges) == []
    else:
        cycle = graphs.find_cycle(edges)
        assert all(b in edges[a] for a, b in zip(cycle, [*cycle[1:], cycle[0]], strict=True))
    for name in edges:
        assert graphs.reachable(edges, name) == {name} | networkx.descendants(graph, name)


@given(edge_maps())
def test_a_node_comes_after_its_successors_outside_of_cycles(edges: Edges) -> None:
    order = graphs.post_order(edges)
    assert sorted(order) == sorted(edges)
    for name in edges:
        for successor in edges[name]:
            if name not in graphs.reachable(edges, successor):
                assert order.index(successor) < order.index(name)


def test_ties_are_broken_by_the_order_of_the_keys() -> None:
    edges = {"c": [], "b": ["a"], "a": [], "d": ["c"]}
    assert graphs.topological_sort(edges) == ["b", "a", "d", "c"]
    assert graphs.post_order(edges) == ["c", "a", "b", "d"]
    assert graphs.format_cycle(["x", "y"]) == "`x` -> `y` -> `x`"


def test_a_check_of_a_small_spec_does_not_import_networkx() -> None:
    code = "import sys, modewright as mw; mw.check('estimator'); print('networkx' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
