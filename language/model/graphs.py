"""Graph: names that read each other, in order; circles; what can be reached."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Mapping, Sequence

Edges = Mapping[str, Iterable[str]]
"""From each name to the names that come after it, all of them keys."""


def topological_sort(edges: Edges) -> list[str] | None:
    """Return the names so that each comes before those that it leads to, None in a circle.

    Of several that may come next, the first in the order of the keys does (Kahn 1962, with a heap).
    """
    names = list(edges)
    place = {name: position for position, name in enumerate(names)}
    after = {name: set(targets) for name, targets in edges.items()}
    waiting = dict.fromkeys(names, 0)
    for targets in after.values():
        for target in targets:
            waiting[target] += 1
    free = [place[name] for name in names if not waiting[name]]
    order: list[str] = []
    while free:
        name = names[heapq.heappop(free)]
        order.append(name)
        for target in after[name]:
            waiting[target] -= 1
            if not waiting[target]:
                heapq.heappush(free, place[target])
    return order if len(order) == len(names) else None


def post_order(reads: Edges) -> list[str]:
    """Return the names, each directly after those that it reads and that are not there yet.

    In a circle, which is reported elsewhere, one member comes before what it reads.
    """
    order: dict[str, None] = {}
    begun: set[str] = set()
    for start in reads:
        stack = [] if start in begun else [(start, iter(list(reads[start])))]
        begun.add(start)
        while stack:
            name, waiting = stack[-1]
            needed = next((read for read in waiting if read in reads and read not in begun), None)
            if needed is None:
                order[name] = None
                stack.pop()
            else:
                begun.add(needed)
                stack.append((needed, iter(list(reads[needed]))))
    return list(order)


def find_cycle(edges: Edges) -> list[str]:
    """Return the members of a circle, each leading to the next; an empty list if there is none."""
    done: set[str] = set()
    for start in edges:
        path: dict[str, None] = {}
        stack = [(start, iter(list(edges[start])))] if start not in done else []
        path.update(dict.fromkeys([start] if stack else []))
        while stack:
            name, targets = stack[-1]
            target = next((t for t in targets if t not in done), None)
            if target is None:
                done.add(name)
                del path[name]
                stack.pop()
            elif target in path:
                members = list(path)
                return members[members.index(target) :]
            else:
                path[target] = None
                stack.append((target, iter(list(edges[target]))))
    return []


def strongly_connected_components(edges: Edges) -> list[list[str]]:
    """Return the groups of names that lead to each other, each in the order of the keys.

    Tarjan 1972, with a stack of its own.
    """
    numbers: dict[str, int] = {}
    lowest: dict[str, int] = {}
    waiting: dict[str, None] = {}
    result: list[list[str]] = []
    place = {name: position for position, name in enumerate(edges)}
    for start in edges:
        stack = [(start, iter(list(edges[start])))] if start not in numbers else []
        while stack:
            name, targets = stack[-1]
            if name not in numbers:
                numbers[name] = lowest[name] = len(numbers)
                waiting[name] = None
            target = next(targets, None)
            if target is None:
                stack.pop()
                if stack:
                    above = stack[-1][0]
                    lowest[above] = min(lowest[above], lowest[name])
                if lowest[name] == numbers[name]:
                    result.append(_pop_component(waiting, name, place))
            elif target not in numbers:
                stack.append((target, iter(list(edges[target]))))
            elif target in waiting:
                lowest[name] = min(lowest[name], numbers[target])
    return result


def _pop_component(waiting: dict[str, None], first: str, place: Mapping[str, int]) -> list[str]:
    """Take the names from `first` on off what waits: one group."""
    group: list[str] = []
    while not group or group[-1] != first:
        group.append(waiting.popitem()[0])
    return sorted(group, key=place.__getitem__)


def reachable(edges: Edges, start: str) -> set[str]:
    """Return what can be reached from a name, the name included."""
    result, stack = {start}, [start]
    while stack:
        for target in edges.get(stack.pop(), ()):
            if target not in result:
                result.add(target)
                stack.append(target)
    return result


def reversed_edges(edges: Edges) -> dict[str, list[str]]:
    """Return the edges in the other direction; what is no key is left out."""
    result: dict[str, list[str]] = {name: [] for name in edges}
    for name, targets in edges.items():
        for target in targets:
            if target in result:
                result[target].append(name)
    return result


def format_cycle(cycle: Sequence[str]) -> str:
    """Return a circle as text, back to its first member."""
    return " -> ".join(f"`{name}`" for name in [*cycle, cycle[0]])
