"""Reachability check: warns of modes that no sequence of transitions enters."""

from __future__ import annotations

from language.checks.check_chart import unreachable_chart_modes
from language.expressions.syntax_tree import FunctionCall, Name, walk
from language.model.automaton import Automaton, Mode, Region
from language.model.chart_paths import mode_paths
from language.model.evaluation_order import unreachable_modes
from language.model.statechart import ROOT, Chart, ChartNode
from language.text.diagnostic import Problems


def check_reachability(automaton: Automaton, problems: Problems) -> None:
    """Warn of modes that no path of transitions from an initial or fault mode enters.

    Guards are not examined. In a chart superstates count, too.
    """
    for mode in _unreachable_modes(automaton, set()):
        problems.warning("unreached", mode.span, f"mode `{mode.name}` is never entered")


def check_blocked_modes(
    automaton: Automaton, dead_transitions: set[str], problems: Problems
) -> None:
    """Warn of modes that are reachable only by dead transitions, given by their key paths.

    Modes that `check_reachability` reports are left out. There are none without dead transitions.
    """
    reported = {mode.key for mode in _unreachable_modes(automaton, set())}
    for mode in _unreachable_modes(automaton, dead_transitions) if dead_transitions else ():
        if mode.key not in reported:
            label = f"mode `{mode.name}` is never entered: what leads to it never fires"
            problems.warning("unreached", mode.span, label)


def _unreachable_modes(automaton: Automaton, dead_transitions: set[str]) -> list[Mode]:
    """Return the modes that neither an initial mode nor the fault mode leads to.

    Transitions with keys in `dead_transitions` are ignored.
    """
    if automaton.statechart:
        return unreachable_chart_modes(automaton, automaton.statechart, dead_transitions)
    return [
        region.modes[name]
        for region in automaton.all_regions
        for name in _unreachable_in_region(automaton, region, dead_transitions)
    ]


def _unreachable_in_region(
    automaton: Automaton, region: Region, dead_transitions: set[str]
) -> list[str]:
    """Return the names of the unreachable modes of a region."""
    unreachable = unreachable_modes(region.modes, region.initial, dead_transitions)
    fault_mode = automaton.fault_mode
    if fault_mode is not None and fault_mode in region.modes:
        unreachable = [
            name
            for name in unreachable
            if name in unreachable_modes(region.modes, fault_mode, dead_transitions)
        ]
    return unreachable


def check_final_modes(automaton: Automaton, problems: Problems) -> None:
    """Warn of final modes of a chart whose completion has no effect.

    A completion has an effect if a completion transition leaves the enclosing mode, or if `in(...)`
    in a guard or an equation reads the final mode. Final modes directly in a region of the root are
    left out.
    """
    chart = automaton.statechart
    if chart is None:
        return
    asked = _queried_nodes(automaton, chart)
    for node in chart.nodes[ROOT + 1 :]:
        completed = _completed_mode(chart, node)
        if not node.is_final or completed is None or node.index in asked:
            continue
        owner = automaton.modes_by_key[completed.mode_key]
        if not any(transition.is_completion for transition in owner.transitions):
            label = (
                f"`{node.name}` is final, but nothing goes on when `{completed.name}` is at its "
            )
            label += "end"
            hint = (
                f"a transition of `{completed.name}` without `when` and `event`; else leave `final`"
            )
            hint += " out"
            problems.warning("stuck", automaton.modes_by_key[node.mode_key].span, label, hint)


def _completed_mode(chart: Chart, node: ChartNode) -> ChartNode | None:
    """Return the mode that a final mode completes; None for a region of the root."""
    outer = chart.nodes[node.parent]
    if outer.is_region:
        outer = chart.nodes[outer.parent]
    return None if outer.index == ROOT else outer


def _queried_nodes(automaton: Automaton, chart: Chart) -> set[int]:
    """Return the indices of the nodes that a guard or an equation reads by `in(...)`."""
    paths = mode_paths(chart)
    trees = [transition.when.tree for transition in automaton.all_transitions]
    trees += [each.tree for mode in automaton.all_modes for each in mode.equations.values()]
    indices: set[int] = set()
    for part in (part for tree in trees for part in walk(tree)):
        if isinstance(part, FunctionCall) and part.function == "in":
            name = part.arguments[0]
            if isinstance(name, Name) and name.path in paths:
                indices.add(paths[name.path].index)
    return indices
