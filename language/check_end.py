"""Check of ends: a final mode whose superstate has no transition for when it is at its end."""

from __future__ import annotations

from language.chart import ROOT, Chart, ChartNode
from language.chart_target import mode_paths
from language.model import Automaton
from language.problem import Problems
from language.syntax import FunctionCall, Name, walk


def check_final_modes(automaton: Automaton, problems: Problems) -> None:
    """Warn of final modes from which nothing goes on; those of a region of the root end it."""
    chart = automaton.statechart
    if chart is None:
        return
    asked = _queried_nodes(automaton, chart)
    for node in chart.nodes[ROOT + 1 :]:
        around = _completed_mode(chart, node)
        if not node.is_final or around is None or node.index in asked:
            continue
        owner = automaton.modes_by_key[around.mode_key]
        if not any(way.is_completion for way in owner.transitions):
            label = f"`{node.name}` is final, but nothing goes on when `{around.name}` is at its "
            label += "end"
            hint = f"a transition of `{around.name}` without `when` and `event`; else leave `final`"
            hint += " out"
            problems.warning("stuck", automaton.modes_by_key[node.mode_key].span, label, hint)


def _completed_mode(chart: Chart, node: ChartNode) -> ChartNode | None:
    """Return the mode that a final one may bring to its end, None for a region of the root."""
    outer = chart.nodes[node.parent]
    if outer.is_region:
        outer = chart.nodes[outer.parent]
    return None if outer.index == ROOT else outer


def _queried_nodes(automaton: Automaton, chart: Chart) -> set[int]:
    """Return the nodes that some guard or equation asks for by `in(...)`."""
    paths = mode_paths(chart)
    trees = [way.when.tree for mode in automaton.all_modes for way in mode.transitions]
    trees += [each.tree for mode in automaton.all_modes for each in mode.equations.values()]
    found: set[int] = set()
    for part in (part for tree in trees for part in walk(tree)):
        if isinstance(part, FunctionCall) and part.function == "in":
            name = part.arguments[0]
            if isinstance(name, Name) and name.path in paths:
                found.add(paths[name.path].index)
    return found
