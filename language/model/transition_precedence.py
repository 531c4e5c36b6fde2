"""Transition precedence: which transitions of a chart win over another one that is enabled."""

from __future__ import annotations

from collections.abc import Iterator

from language.expressions.syntax_tree import MEMORY_FUNCTIONS, FunctionCall, walk
from language.ir.analysis_cache import cache_on_owner
from language.model.automaton import Automaton, Mode, Transition
from language.model.region_queries import earlier_by_priority
from language.model.statechart import ChartNode


def node_of(automaton: Automaton, mode: Mode) -> ChartNode | None:
    """Return the node of a mode in the chart of its automaton, found by the key path of the mode.

    The result is None without a chart or without such a node.
    """
    nodes = automaton.statechart.nodes if automaton.statechart else ()
    return next((node for node in nodes if node.mode_key == mode.key), None)


def preceding_transitions(
    automaton: Automaton, mode: Mode, transition: Transition
) -> list[Transition]:
    """Return the transitions that fire before `transition`, one of a mode, if all can fire.

    These are the transitions of the mode that come before it by priority, then, with `order:
    outer_first`, those of the superstates around the mode in its region, from the inside out and in
    the order of the file. Only transitions that react to all events to which `transition` reacts
    (`covers_events`) are returned; guards and waits are not considered. Raises ValueError if the
    transition does not belong to the mode.
    """
    result = earlier_by_priority(mode, transition)
    chart, node = automaton.statechart, node_of(automaton, mode)
    if chart and node and chart.order == "outer_first":
        result += [
            other
            for outer in chart.region_ancestors(node)[1:]
            for other in _transitions_of(automaton, outer)
        ]
    return [other for other in result if covers_events(automaton, other, transition)]


def inner_preceding_transitions(
    automaton: Automaton, mode: Mode
) -> Iterator[tuple[Mode, list[Transition]]]:
    """Yield each innermost mode of a superstate with the inner transitions that win over its own.

    The transitions are those of the innermost mode, then of its ancestors below the superstate;
    events, guards and waits are not considered. Yields nothing with `order: outer_first`, without a
    chart, and if `mode` is an innermost mode.
    """
    chart, node = automaton.statechart, node_of(automaton, mode)
    if chart is None or node is None or chart.order != "inner_first":
        return
    for leaf in chart.leaves_of(node) if node.number is None else ():
        chain = chart.region_ancestors(leaf)
        inner = chain[: _position_of(chain, node)]
        transitions = [other for each in inner for other in _transitions_of(automaton, each)]
        yield automaton.modes_by_key[leaf.mode_key], transitions


def covers_events(automaton: Automaton, transition: Transition, other: Transition) -> bool:
    """Tell whether `transition` reacts to all events to which `other` reacts.

    A transition without `event` reacts to all, and only such a one covers another without `event`.
    Events that can never occur (`possible_events`) are ignored.
    """
    if not transition.events or not other.events:
        return not transition.events
    return {*other.events} & possible_events(automaton) <= {*transition.events}


@cache_on_owner
def possible_events(automaton: Automaton) -> frozenset[str]:
    """Return the events of a chart that are inputs or that some transition raises.

    Without a chart only the raised events are returned.
    """
    signals = automaton.statechart.events if automaton.statechart else {}
    inputs = (name for name, signal in signals.items() if signal.is_input)
    raised = (name for transition in automaton.all_transitions for name in transition.raises)
    return frozenset((*inputs, *raised))


def is_guard_portable(transition: Transition) -> bool:
    """Tell whether the guard of a transition means the same in a mode inside the transition's mode.

    It does unless it calls one of MEMORY_FUNCTIONS other than `after` (`rising`, `falling`,
    `changed`, `every`, `previous`, `delay`), because their memory belongs to an activation. For
    `after` it does: no mode is active for longer than its superstate.
    """
    parts = walk(transition.when.tree)
    used = {part.function for part in parts if isinstance(part, FunctionCall)}
    return used.isdisjoint({*MEMORY_FUNCTIONS} - {"after"})


def _transitions_of(automaton: Automaton, node: ChartNode) -> tuple[Transition, ...]:
    """Return the transitions of the mode of a node; empty for a node without a mode."""
    return (
        automaton.modes_by_key[node.mode_key].transitions
        if node.mode_key in automaton.modes_by_key
        else ()
    )


def _position_of(chain: tuple[ChartNode, ...], node: ChartNode) -> int:
    """Return the index of a node in a chain of ancestors."""
    return next(place for place, each in enumerate(chain) if each.index == node.index)
