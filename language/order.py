"""Order: what reads what, so that each name comes after those that it reads."""

from __future__ import annotations

from collections.abc import Mapping

import networkx as nx

from language.model import Mode
from language.problem import Problems, Span, SpecError
from language.syntax import Tree, names


def equation_order(mode: Mode) -> list[str]:
    """Return the names of a mode's equations so that each comes after those that it reads.

    Ties are broken by the order in the file. Raises SpecError naming an algebraic loop.
    """
    trees = {name: formula.tree for name, formula in mode.equations.items()}
    graph = _reading(trees)
    place = {name: position for position, name in enumerate(trees)}
    try:
        return list(nx.lexicographical_topological_sort(graph, key=lambda name: place[name]))
    except nx.NetworkXUnfeasible:
        loop = [edge[0] for edge in nx.find_cycle(graph)]
        problems = Problems()
        label = f"an algebraic loop in mode `{mode.name}`: {chain(loop)}"
        hint = "each reads the one before it at the same instant; one of them has to be a state"
        problems.error("loop", mode.equations[loop[0]].span, label, hint)
        raise SpecError(problems.found) from None


def report_circle(
    trees: Mapping[str, Tree], spans: Mapping[str, Span], what: str, problems: Problems
) -> None:
    """Report names whose values follow from each other in a circle."""
    try:
        loop = [edge[0] for edge in nx.find_cycle(_reading(trees))]
    except nx.NetworkXNoCycle:
        return
    problems.error("loop", spans[loop[0]], f"`{what}` values in a circle: {chain(loop)}")


def unreached(modes: Mapping[str, Mode], initial: str) -> list[str]:
    """Return the modes that no chain of transitions from the initial mode enters."""
    graph: nx.DiGraph[str] = nx.DiGraph()
    graph.add_nodes_from(modes)
    for mode in modes.values():
        graph.add_edges_from((mode.name, transition.target) for transition in mode.transitions)
    return [name for name in modes if name != initial and not nx.has_path(graph, initial, name)]


def chain(loop: list[str]) -> str:
    """Return a loop as text, back to its first member."""
    return " -> ".join(f"`{name}`" for name in [*loop, loop[0]])


def _reading(trees: Mapping[str, Tree]) -> nx.DiGraph[str]:
    graph: nx.DiGraph[str] = nx.DiGraph()
    graph.add_nodes_from(trees)
    for name, tree in trees.items():
        graph.add_edges_from((read.path, name) for read in names(tree) if read.path in trees)
    return graph
