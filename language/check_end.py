"""Check of ends: a final mode whose superstate has no transition for when it is at its end."""

from __future__ import annotations

from language.chart import ROOT, Chart, Node
from language.chart_target import mode_paths
from language.model import Automaton
from language.problem import Problems
from language.syntax import Application, Name, walk


def check_ends(automaton: Automaton, problems: Problems) -> None:
    """Warn of final modes from which nothing goes on; those of a region of the root end it."""
    chart = automaton.tree
    if chart is None:
        return
    asked = _asked(automaton, chart)
    for node in chart.nodes[ROOT + 1 :]:
        around = _around(chart, node)
        if not node.final or around is None or node.index in asked:
            continue
        owner = automaton.by_key[around.mode]
        if not any(way.completes for way in owner.transitions):
            label = f"`{node.name}` is final, but nothing goes on when `{around.name}` is at its "
            label += "end"
            hint = f"a transition of `{around.name}` without `when` and `event`; else leave `final`"
            hint += " out"
            problems.warning("stuck", automaton.by_key[node.mode].span, label, hint)


def _around(chart: Chart, node: Node) -> Node | None:
    """Return the mode that a final one may bring to its end, None for a region of the root."""
    outer = chart.nodes[node.parent]
    if outer.is_region:
        outer = chart.nodes[outer.parent]
    return None if outer.index == ROOT else outer


def _asked(automaton: Automaton, chart: Chart) -> set[int]:
    """Return the nodes that some guard or equation asks for by `in(...)`."""
    paths = mode_paths(chart)
    trees = [way.when.tree for mode in automaton.all_modes for way in mode.transitions]
    trees += [each.tree for mode in automaton.all_modes for each in mode.equations.values()]
    found: set[int] = set()
    for part in (part for tree in trees for part in walk(tree)):
        if isinstance(part, Application) and part.function == "in":
            name = part.arguments[0]
            if isinstance(name, Name) and name.path in paths:
                found.add(paths[name.path].index)
    return found
