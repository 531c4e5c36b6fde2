"""Precedence: which transitions of a chart come before another one, wherever both are enabled."""

from __future__ import annotations

from collections.abc import Iterator

from language.chart import Node
from language.model import Automaton, Mode, Transition
from language.once import once
from language.region import by_priority
from language.syntax import MEMORY, Application, walk


def node_of(automaton: Automaton, mode: Mode) -> Node | None:
    """Return the node of a mode in its chart, None where modes stand side by side alone."""
    nodes = automaton.tree.nodes if automaton.tree else ()
    return next((node for node in nodes if node.mode == mode.key), None)


def winners(automaton: Automaton, mode: Mode, transition: Transition) -> list[Transition]:
    """Return the transitions that win against one of a mode, guards and waits aside.

    Those of smaller priority, and with `order: outer_first` those of the modes around it.
    """
    position = [way for _, way in by_priority(mode)].index(transition)
    found = [way for _, way in by_priority(mode)[:position]]
    chart, node = automaton.tree, node_of(automaton, mode)
    if chart and node and chart.order == "outer_first":
        found += [way for outer in chart.chain(node)[1:] for way in _ways(automaton, outer)]
    return [way for way in found if comes_along(automaton, way, transition)]


def inside_first(automaton: Automaton, mode: Mode) -> Iterator[tuple[Mode, list[Transition]]]:
    """Yield the innermost modes of a superstate with the transitions inside that win against its.

    With `order: outer_first` there are none.
    """
    chart, node = automaton.tree, node_of(automaton, mode)
    if chart is None or node is None or chart.order != "inner_first":
        return
    for leaf in chart.leaves_of(node) if node.number is None else ():
        chain = chart.chain(leaf)
        inner = chain[: _place(chain, node)]
        found = [way for each in inner for way in _ways(automaton, each)]
        yield automaton.by_key[leaf.mode], found


def comes_along(automaton: Automaton, way: Transition, other: Transition) -> bool:
    """Tell whether a transition may be taken in every micro-step in which another may."""
    if not way.events or not other.events:
        return not way.events
    return {*other.events} & events_that_come(automaton) <= {*way.events}


@once
def events_that_come(automaton: Automaton) -> frozenset[str]:
    """Return the events of a chart that are inputs or that a transition raises."""
    signals = automaton.tree.signals if automaton.tree else {}
    raised = (way.raises for mode in automaton.all_modes for way in mode.transitions)
    inputs = (name for name, signal in signals.items() if signal.is_input)
    return frozenset((*inputs, *(name for names in raised for name in names)))


def means_the_same(way: Transition) -> bool:
    """Tell whether the guard of a mode can be read where one inside it reads its own.

    Edges and beats are those of an activation. Of `after` is known that no mode is active for
    longer than one around it.
    """
    parts = walk(way.when.tree)
    used = {part.function for part in parts if isinstance(part, Application)}
    return used.isdisjoint({*MEMORY} - {"after"})


def _ways(automaton: Automaton, node: Node) -> tuple[Transition, ...]:
    return automaton.by_key[node.mode].transitions if node.mode in automaton.by_key else ()


def _place(chain: tuple[Node, ...], node: Node) -> int:
    return next(place for place, each in enumerate(chain) if each.index == node.index)
