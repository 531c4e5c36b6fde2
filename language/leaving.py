"""Leaving: what a chart forgets, keeps and does when nodes are left, the innermost first."""

from __future__ import annotations

from language.activation import edges_by_mode
from language.chart import Node
from language.charting import Charting, ident, kept, leaves_flag
from language.operation import Assign, Block, Choose, Op, Ref, Run, Value, whole
from language.program import mode_variable


def leaving_blocks(charting: Charting) -> dict[str, Block]:
    """Return `leave_<node>`: what is active inside a node that some transition leaves, and
    `quit_<region>`: a region with what is active inside it.
    """
    chart = charting.chart
    blocks: dict[str, Block] = {}
    for index in sorted(chart.reach(way for _, way in charting.all_ways)):
        node = chart.nodes[index]
        blocks[f"leave_{ident(node.path)}"] = _active(charting, node, node.index)
    for region in chart.regions:
        if chart.outer_region(region):
            blocks[_quits(region).block] = _active(charting, region, None)
    return blocks


def leave(node: Node) -> Run:
    """Return what leaves the inside of a node."""
    return Run(f"leave_{ident(node.path)}")


def _quits(region: Node) -> Run:
    return Run(f"quit_{ident(region.path)}")


def _active(charting: Charting, node: Node, staying: int | None) -> Block:
    """What is active in a node, the innermost first, up to one that stays."""
    cases = []
    for leaf in charting.chart.leaves_of(node):
        ops: list[Op] = [_quits(region) for region in charting.chart.inner_regions(leaf)]
        for each in charting.chart.chain(leaf):
            if each.index == staying:
                break
            ops += _one(charting, each)
        if ops and leaf.number is not None:
            cases.append((leaf.number, tuple(ops)))
    return (Choose(mode_variable("memory.mode", node.region), tuple(cases)),) if cases else ()


def _one(charting: Charting, node: Node) -> list[Op]:
    """What leaving one node means at once; its exit comes as a stage."""
    ops: list[Op] = []
    mode = charting.mode(node)
    if node.index in charting.remembered:
        now = Ref(mode_variable("memory.mode", node.region), True)
        ops.append(Assign(kept(node).name, now if node.kind == "compound" else whole(1)))
    if mode is None:
        return ops
    if mode.exit:
        ops.append(Assign(leaves_flag(node).name, Value(True)))
    if node.index not in charting.continued:
        timers = [charting.info(way).timer for way in mode.transitions]
        ops += [Assign(timer, whole(0)) for timer in timers if timer]
    edges = edges_by_mode(charting.automaton).get(mode.key, ())
    return [*ops, *(Assign(edge.opposite, Value(False)) for edge in edges)]
