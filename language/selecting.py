"""Selecting: which transitions of a chart a micro-step takes (rules 3 and 15).

Each region wishes for one: that of the outermost or of the innermost of its active modes that has
one enabled, by `order`. Then the wishes are heard from the innermost regions on, as by SCXML (2015,
`removeConflictingTransitions`): of two that leave the same mode the one from further inside stays,
else the one heard first; regions side by side are heard in the order of their `priority`.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Sequence

from language.activation import edges_by_mode, guard_names, watch_edges
from language.activity import is_complete
from language.chart import Node
from language.charting import FIRST, OVER, Charting, ident, taken, wish
from language.event import happens
from language.fault import FIRST as FAULT_FIRST
from language.limit import HAPPENED
from language.lower import expression
from language.model import CHART, Mode, Transition
from language.operation import (
    Assign,
    Binary,
    Block,
    Branch,
    Choose,
    Compare,
    Count,
    Expr,
    Op,
    Ref,
    Run,
    Value,
    whole,
)
from language.program import Variable, mode_variable
from language.region import by_priority
from language.transition import awaited

NOTHING = (1, 0)
"""First and last node of an inside that is empty."""


def selection_blocks(charting: Charting) -> dict[str, Block]:
    """Return `count_<mode>`, `choose_<mode>` of modes, `select_transitions` and `hear`."""
    blocks: dict[str, Block] = {}
    for node in charting.chart.nodes:
        mode = charting.mode(node)
        if mode and mode.transitions:
            counts, chosen = _watched(charting, node, mode)
            if counts:
                blocks[f"count_{ident(node.path)}"] = counts
            blocks[f"choose_{ident(node.path)}"] = chosen
    regions = charting.chart.regions
    ops: list[Op] = [Assign(wish(region.region), whole(0)) for region in regions]
    for region in regions:
        ops += _wish(charting, region, blocks)
    blocks["select_transitions"] = tuple(ops)
    if len(regions) > 1:
        blocks.update(_hearing(charting))
    return blocks


def selection_variables(charting: Charting) -> list[Variable]:
    """Return the variables of wishes and of what is taken."""
    found = []
    for region in charting.chart.regions:
        name = region.region
        found += [
            Variable(wish(name), "whole", about="transition that the region wishes for, 0: none"),
            Variable(taken(name), "whole", about="transition that it takes, 0: none"),
            Variable(_low(region), "whole", about="first node of what its wish leaves"),
            Variable(_high(region), "whole", about="last node of what its wish leaves"),
            Variable(_heard(region), "truth", about="its wish was decided on"),
        ]
    return [
        *found,
        Variable("work.keeps", "truth", about="no transition that is taken leaves the same"),
        Variable(FIRST.name, "truth", about="this is the first micro-step of the tick"),
        Variable(OVER.name, "truth", about="no further micro-step is allowed"),
    ]


def _watched(charting: Charting, node: Node, mode: Mode) -> tuple[Block, Block]:
    """Return the counters and edges of a mode's transitions, and the choice among them."""
    automaton = charting.automaton
    edges = tuple(watch_edges(automaton, mode, charting.everywhere))
    known = ChainMap(guard_names(automaton, mode), dict(charting.everywhere))
    counts: list[Op] = []
    later: list[Op] = []
    chain: Block = ()
    for _, transition in reversed(by_priority(mode)):
        info = charting.info(transition)
        enabled = _enabled(charting, node, transition, expression(transition.when.tree, known))
        if info.timer:
            timer = Ref(info.timer)
            key = f"{automaton.name} {transition.when.key}"
            counts.insert(0, Count(info.timer, enabled, info.most, key))
            begin = (Assign(info.timer, whole(1)),)
            begun = (Branch(Compare("==", timer, whole(0)), begin),)
            later.insert(0, Branch(enabled, begun, (Assign(info.timer, whole(0)),)))
            enabled = Compare(">", timer, awaited(info))
        take = Assign(wish(node.region), whole(info.number), info.key)
        chain = (Branch(enabled, (take,), chain),)
    return _counting(charting, mode, edges, tuple(counts), tuple(later)), chain


def _counting(charting: Charting, mode: Mode, edges: Block, counts: Block, later: Block) -> Block:
    """A tick counts once; a wait that begins in a later micro-step begins there (rule 4)."""
    if not charting.several or not (edges or counts):
        return (*edges, *counts)
    found = edges_by_mode(charting.automaton).get(mode.key, ())
    over = tuple(Assign(f"work.edge_{edge.number}", Value(False)) for edge in found)
    return (Branch(FIRST, (*edges, *counts), (Branch(OVER, over, (*edges, *later)),)),)


def _enabled(charting: Charting, node: Node, transition: Transition, guard: Expr) -> Expr:
    event = happens(charting.chart, transition)
    if transition.completes:
        return is_complete(charting.chart, node, "memory.mode")
    if event is None:
        return guard
    return event if guard == Value(True) else Binary("and", event, guard)


def _wish(charting: Charting, region: Node, blocks: dict[str, Block]) -> Block:
    """What a region wishes for in each of its innermost modes."""
    cases = []
    for leaf in charting.chart.leaves(region.region):
        assert leaf.number is not None
        ops = _wish_in(charting, leaf, blocks)
        if ops:
            cases.append((leaf.number, ops))
    found: Block = (Choose(mode_variable("memory.mode", region.region), tuple(cases)),)
    if not cases:
        return ()
    return (Branch(Ref(HAPPENED), (), found),) if _yields(charting, region) else found


def _yields(charting: Charting, region: Node) -> bool:
    """Tell whether a fault leaves a region: the mode of the chart that holds it has a way out."""
    holding = [leaf for leaf in charting.chart.leaves(CHART) if leaf.holds(region.index)]
    return any(way.priority == FAULT_FIRST for leaf in holding for way in charting.ways_of(leaf))


def _wish_in(charting: Charting, leaf: Node, blocks: dict[str, Block]) -> Block:
    chain = [n for n in charting.chart.chain(leaf) if charting.ways_of(n)]
    names = [ident(node.path) for node in chain]
    ops: list[Op] = [Run(f"count_{name}") for name in names if f"count_{name}" in blocks]
    order = names if charting.chart.order == "inner_first" else names[::-1]
    chosen: Block = ()
    none = Compare("==", Ref(wish(leaf.region)), whole(0))
    for name in reversed(order):
        more: Block = (Branch(none, chosen),) if chosen else ()
        chosen = (Run(f"choose_{name}"), *more)
    fault = next((w for w in charting.ways_of(leaf) if w.priority == FAULT_FIRST), None)
    if fault and charting.chart.order == "outer_first" and len(names) > 1:
        at_once = Assign(wish(leaf.region), whole(charting.info(fault).number))
        chosen = (Branch(Ref(HAPPENED), (at_once,), chosen),)
    return (*ops, *chosen)


def _hearing(charting: Charting) -> dict[str, Block]:
    """Return `hear`, which makes of the wishes what is taken, and `hear_<region>`."""
    regions = charting.chart.regions
    pairs = {region.index: _rivals(charting, region) for region in regions}
    conflicts = any(pairs.values())
    blocks: dict[str, Block] = {}
    ops: list[Op] = []
    for region in regions:
        ops.append(Assign(taken(region.region), whole(0)))
        ops.append(Assign(_heard(region), Value(False)))
        if conflicts:
            ops += _inside_of(charting, region)
        blocks[f"hear_{ident(region.region)}"] = _hear(charting, region, pairs[region.index])
    for region in regions:
        ops += _leaf_hears(charting, region)
    blocks["hear"] = tuple(ops)
    return blocks


def _rivals(charting: Charting, region: Node) -> list[Node]:
    """Return the regions with a transition that leaves something that one of this region leaves."""
    chart = charting.chart
    own = chart.reach(way for _, way in charting.ways_in(region.region))
    found = []
    for other in chart.regions:
        theirs = chart.reach(way for _, way in charting.ways_in(other.region))
        if other is not region and any(chart.nested(a, b) for a in own for b in theirs):
            found.append(other)
    return found


def _inside_of(charting: Charting, region: Node) -> Block:
    """Set the first and last node of what the wish of a region leaves."""
    cases = []
    for transition, way in charting.ways_in(region.region):
        low, high = NOTHING
        if way.domain is not None:
            low, high = way.domain, charting.chart.nodes[way.domain].last
        ops = (Assign(_low(region), whole(low)), Assign(_high(region), whole(high)))
        cases.append((charting.info(transition).number, ops))
    return (
        Assign(_low(region), whole(NOTHING[0])),
        Assign(_high(region), whole(NOTHING[1])),
        Choose(wish(region.region), tuple(cases)),
    )


def _hear(charting: Charting, region: Node, rivals: Sequence[Node]) -> Block:
    """Take the wish of a region unless one that is taken already leaves the same."""
    keeps = Ref("work.keeps")
    take: list[Op] = [Assign(taken(region.region), Ref(wish(region.region)))]
    ops: list[Op] = [Assign(_heard(region), Value(True))]
    if rivals:
        ops.append(Assign(keeps.name, Value(True)))
    for other in rivals:
        is_taken = Compare("!=", Ref(taken(other.region)), whole(0))
        clash = Binary("and", is_taken, _overlap(region, other))
        if charting.chart.is_inside(region, other):
            take.insert(0, Branch(clash, (Assign(taken(other.region), whole(0)),)))
        else:
            ops.append(Branch(clash, (Assign(keeps.name, Value(False)),)))
    return (*ops, Branch(keeps, tuple(take))) if rivals else (*ops, *take)


def _overlap(left: Node, right: Node) -> Expr:
    """Tell whether one of two insides begins in the other."""

    def begins(inner: Node, outer: Node) -> Expr:
        low = Ref(_low(inner))
        after = Compare("<=", Ref(_low(outer)), low)
        return Binary("and", after, Compare("<=", low, Ref(_high(outer))))

    some = Binary(
        "and",
        Compare("<=", Ref(_low(left)), Ref(_high(left))),
        Compare("<=", Ref(_low(right)), Ref(_high(right))),
    )
    return Binary("and", some, Binary("or", begins(left, right), begins(right, left)))


def _leaf_hears(charting: Charting, region: Node) -> Block:
    """In its innermost modes without regions, a region is heard: its own wish or one around it."""
    chart = charting.chart
    plain = [leaf for leaf in chart.leaves(region.region) if leaf.kind == "atomic"]
    around = [region]
    while (outer := chart.outer_region(around[-1])) is not None:
        around.append(outer)
    if chart.order == "outer_first":
        around.reverse()
    ops: Block = ()
    for each in reversed(around):
        if not charting.ways_in(each.region):
            continue
        fresh = Branch(Ref(_heard(each)), (), (Run(f"hear_{ident(each.region)}"),))
        ops = (Branch(Compare("!=", Ref(wish(each.region)), whole(0)), (fresh,), ops),)
    cases = tuple((leaf.number, ops) for leaf in plain if leaf.number is not None)
    if not ops or not cases:
        return ()
    return (Choose(mode_variable("memory.mode", region.region), cases),)


def _low(region: Node) -> str:
    return f"work.low_{ident(region.region)}"


def _high(region: Node) -> str:
    return f"work.high_{ident(region.region)}"


def _heard(region: Node) -> str:
    return f"work.heard_{ident(region.region)}"
