"""Layered layout: place boxes and labelled edges in columns from left to right with few crossings.

The method of Sugiyama, Tagawa and Toda (1981): break cycles, assign ranks, order by barycentres,
place. The label of an edge is an item between the columns of its ends, so that labels never
overlap.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field

Size = tuple[float, float]
Point = tuple[float, float]

COLUMN_GAP = 34.0
"""Distance of columns [px], in which the lines bend."""
ITEM_SPACING = 12.0
"""Smallest distance of the items of a column [px]."""
SWEEPS = 16
"""Passes over the columns; more do not improve diagrams of 20 modes."""


@dataclass(frozen=True)
class Edge:
    """An edge between two boxes (by index) with the size of its label [px]."""

    source: int
    target: int
    label: Size


@dataclass(frozen=True)
class Route:
    """The path of an edge: polylines, and the upper left corner of its label."""

    pieces: tuple[tuple[Point, ...], ...]
    label: Point


@dataclass(frozen=True)
class Layout:
    """Upper left corners of the boxes, routes of the edges in their order, and the total size
    [px].
    """

    boxes: tuple[Point, ...]
    routes: tuple[Route, ...]
    size: Size


@dataclass(eq=False)
class _Item:
    """An item of a column: a box, a label, or a point through which an edge passes."""

    size: Size
    column: int
    top_margin: float = 0.0
    y: float = 0.0
    before: list[_Item] = field(default_factory=list, repr=False)
    after: list[_Item] = field(default_factory=list, repr=False)


def compute_layout(
    boxes: Sequence[Size], edges: Sequence[Edge], top_margins: Sequence[float] = ()
) -> Layout:
    """Return the layout of boxes and of labelled edges in columns from left to right.

    `boxes` are sizes [px]; the first box is the start and is in the first column. `edges` connect
    different boxes by index. Edges do not end in the upper `top_margins` [px] of a box (none if
    empty). Without boxes the size is (0, 0).
    """
    backward = _find_backward_edges(len(boxes), edges)
    ranks = _assign_ranks(len(boxes), edges, backward)
    items = [
        _Item(size, 2 * rank, lid)
        for size, rank, lid in zip(boxes, ranks, top_margins or [0.0] * len(boxes), strict=True)
    ]
    chains = [_insert_dummies(edge, k in backward, items) for k, edge in enumerate(edges)]
    columns = _group_columns(items, chains)
    _reduce_crossings(columns)
    _assign_heights(columns)
    lefts, widths = _column_extents(columns)
    bottom = max((item.y + item.size[1] / 2 for column in columns for item in column), default=0.0)
    corners = tuple(
        (lefts[item.column] + (widths[item.column] - item.size[0]) / 2, item.y - item.size[1] / 2)
        for item in items
    )
    routes = _route_edges(edges, backward, items, chains, lefts, widths)
    return Layout(corners, routes, (lefts[-1] + widths[-1] if lefts else 0.0, bottom))


def _find_backward_edges(count: int, edges: Sequence[Edge]) -> set[int]:
    """Return the indices of the edges against the breadth-first order from the first box.

    Breadth-first order keeps boxes near the start on the left. Depth-first order would break fewer
    edges, but give long rows.
    """
    order: list[int] = []
    for start in range(count):
        waiting = [start]
        for node in waiting:
            if node not in order:
                order.append(node)
                waiting += [edge.target for edge in edges if edge.source == node]
    place = {node: k for k, node in enumerate(order)}
    return {k for k, edge in enumerate(edges) if place[edge.target] < place[edge.source]}


def _assign_ranks(count: int, edges: Sequence[Edge], backward: set[int]) -> list[int]:
    """Return the rank of each box: the length of the longest path to it without backward edges."""
    ends = [
        (e.target, e.source) if k in backward else (e.source, e.target) for k, e in enumerate(edges)
    ]
    ranks = [0] * count
    for _ in range(count):
        for first, second in ends:
            ranks[second] = max(ranks[second], ranks[first] + 1)
    return ranks


def _insert_dummies(edge: Edge, reversed_: bool, items: Sequence[_Item]) -> list[_Item]:
    """Return the label and the passages of an edge from left to right, linked to its boxes."""
    left, right = items[edge.source], items[edge.target]
    if reversed_:
        left, right = right, left
    columns = range(left.column + 1, right.column)
    label = columns[-1] if reversed_ else columns[0]
    chain = [_Item(edge.label if c == label else (0.0, 4.0), c) for c in columns]
    for a, b in zip([left, *chain], [*chain, right], strict=True):
        a.after.append(b)
        b.before.append(a)
    return chain


def _group_columns(items: Sequence[_Item], chains: Sequence[Sequence[_Item]]) -> list[list[_Item]]:
    """Return the items of each column."""
    everything = [*items, *(item for chain in chains for item in chain)]
    columns: list[list[_Item]] = [[] for _ in range(max((i.column for i in items), default=-1) + 1)]
    for item in everything:
        columns[item.column].append(item)
    return columns


def _reduce_crossings(columns: list[list[_Item]]) -> None:
    """Order the items of each column by barycentres in sweeps; keep the best order."""
    best, fewest = [list(column) for column in columns], _count_crossings(columns)
    for sweep in range(SWEEPS):
        forward = sweep % 2 == 0
        for column in columns if forward else reversed(columns):
            place = {item: k for each in columns for k, item in enumerate(each)}
            means = {}
            for k, item in enumerate(column):
                beside = item.before if forward else item.after
                own = [place[other] for other in beside]
                means[item] = sum(own) / len(own) if own else float(k)
            column.sort(key=lambda item: means[item])
        count = _count_crossings(columns)
        if count < fewest:
            best, fewest = [list(column) for column in columns], count
    columns[:] = best


def _count_crossings(columns: Sequence[Sequence[_Item]]) -> int:
    """Return the number of crossings of edges between neighbouring columns."""
    place = {item: k for column in columns for k, item in enumerate(column)}
    total = 0
    for column in columns:
        lines = [(place[a], place[b]) for a in column for b in a.after]
        for k, (a, b) in enumerate(lines):
            total += sum((a - c) * (b - d) < 0 for c, d in lines[:k])
    return total


def _assign_heights(columns: Sequence[Sequence[_Item]]) -> None:
    """Set the height of each item near the mean of its neighbours, without change of order or
    overlap.
    """
    for column in columns:
        _resolve_overlaps(column, [0.0] * len(column))
    for sweep in range(2 * SWEEPS):
        for column in columns if sweep % 2 == 0 else reversed(columns):
            desired = []
            for item in column:
                beside = [*item.before, *item.after]
                desired.append(sum(b.y for b in beside) / len(beside) if beside else item.y)
            _resolve_overlaps(column, desired)
    top = min((item.y - item.size[1] / 2 for column in columns for item in column), default=0.0)
    for column in columns:
        for item in column:
            item.y -= top


def _resolve_overlaps(column: Sequence[_Item], desired: Sequence[float]) -> None:
    """Set the heights of a column nearest to the desired ones (least squares) without overlap.

    After subtraction of the distances this is isotonic regression (pool adjacent violators).
    """
    offsets = [0.0]
    for above, below in itertools.pairwise(column):
        offsets.append(offsets[-1] + (above.size[1] + below.size[1]) / 2 + ITEM_SPACING)
    pools: list[tuple[float, int]] = []
    for value, offset in zip(desired, offsets, strict=False):
        total, count = value - offset, 1
        while pools and pools[-1][0] / pools[-1][1] > total / count:
            last = pools.pop()
            total, count = total + last[0], count + last[1]
        pools.append((total, count))
    pool_means = [total / count for total, count in pools for _ in range(count)]
    for item, value, offset in zip(column, pool_means, offsets, strict=False):
        item.y = value + offset


def _column_extents(columns: Sequence[Sequence[_Item]]) -> tuple[list[float], list[float]]:
    """Return left ends and widths of the columns [px]."""
    widths = [max(item.size[0] for item in column) for column in columns]
    lefts: list[float] = []
    for k, _ in enumerate(widths):
        lefts.append(lefts[-1] + widths[k - 1] + COLUMN_GAP if lefts else 0.0)
    return lefts, widths


def _route_edges(
    edges: Sequence[Edge],
    backward: set[int],
    items: Sequence[_Item],
    chains: Sequence[Sequence[_Item]],
    lefts: Sequence[float],
    widths: Sequence[float],
) -> tuple[Route, ...]:
    """Return the routes of all edges in their order."""
    ports = _port_heights(edges, backward, items, chains)
    routes = []
    for k, (edge, chain) in enumerate(zip(edges, chains, strict=True)):
        ends = [items[edge.source], items[edge.target]]
        left, right = reversed(ends) if k in backward else ends
        label = chain[-1] if k in backward else chain[0]
        edge_of = lefts[left.column] + (widths[left.column] + left.size[0]) / 2
        piece: list[Point] = [(edge_of, ports[k][0])]
        pieces, corner = [], (0.0, 0.0)
        for item in chain:
            start = lefts[item.column] + (widths[item.column] - item.size[0]) / 2
            if item is label:
                corner = (start, item.y - item.size[1] / 2)
                pieces.append((*piece, (lefts[item.column], item.y), (start, item.y)))
                end = lefts[item.column] + widths[item.column]
                piece = [(start + item.size[0], item.y), (end, item.y)]
            else:
                piece += [(lefts[item.column], item.y)]
                piece += [(lefts[item.column] + widths[item.column], item.y)]
        start = lefts[right.column] + (widths[right.column] - right.size[0]) / 2
        pieces.append((*piece, (start, ports[k][1])))
        if k in backward:
            pieces = [tuple(reversed(points)) for points in reversed(pieces)]
        routes.append(Route(tuple(pieces), corner))
    return tuple(routes)


def _port_heights(
    edges: Sequence[Edge],
    backward: set[int],
    items: Sequence[_Item],
    chains: Sequence[Sequence[_Item]],
) -> list[list[float]]:
    """Return the heights [px] at which each edge meets its left and its right box.

    The edges at one side of a box are distributed in the order of their neighbours.
    """
    ports = [[0.0, 0.0] for _ in edges]
    for node, item in enumerate(items):
        for side in (0, 1):
            here = []
            for k, edge in enumerate(edges):
                first = edge.target if k in backward else edge.source
                second = edge.source if k in backward else edge.target
                if (first, second)[side] == node:
                    here.append((chains[k][0 if side == 0 else -1].y, k))
            for position, (_, k) in enumerate(sorted(here), 1):
                share = position / (len(here) + 1) - 0.5
                ports[k][side] = (
                    item.y + item.top_margin / 2 + share * (item.size[1] - item.top_margin)
                )
    return ports
