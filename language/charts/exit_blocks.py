"""Exit blocks of a chart: history, timers, edges and exit flags of left nodes, innermost first."""

from __future__ import annotations

from language.charts.chart_context import ChartContext, history_ref, to_identifier
from language.ir.ops import Assign, Block, Op, Ref, RunBlock, Switch, Value, integer
from language.ir.program import mode_variable
from language.lowering.edge_detection import edge_detectors_by_mode
from language.model.statechart import ChartNode


def exit_blocks(context: ChartContext) -> dict[str, Block]:
    """Return the blocks `leave_<node>` and `quit_<region>`, by name.

    `leave_<node>` leaves the active nodes inside a node that is the domain of some transition, but
    not the node itself; `quit_<region>` leaves a nested region with its active nodes. Leaving
    stores histories, sets exit flags, and clears timers and edges; exit actions are not included.
    """
    chart = context.chart
    blocks: dict[str, Block] = {}
    for index in sorted(
        chart.exited_domains(chart_transition for _, chart_transition in context.all_transitions)
    ):
        node = chart.nodes[index]
        blocks[f"leave_{to_identifier(node.path)}"] = _exit_active_nodes(context, node, node.index)
    for region in chart.regions:
        if chart.parent_region(region):
            blocks[_run_region_exit(region).block] = _exit_active_nodes(context, region, None)
    return blocks


def run_exit_block(node: ChartNode) -> RunBlock:
    """Return the operation that runs `leave_<node>`: the active nodes inside a node are left."""
    return RunBlock(f"leave_{to_identifier(node.path)}")


def _run_region_exit(region: ChartNode) -> RunBlock:
    """Return the operation that leaves a region and its active nodes."""
    return RunBlock(f"quit_{to_identifier(region.path)}")


def _exit_active_nodes(context: ChartContext, node: ChartNode, stop_index: int | None) -> Block:
    """Return a Switch that leaves the active nodes in a node, innermost first.

    The node with `stop_index` and those around it stay active.
    """
    cases = []
    for leaf in context.chart.leaves_of(node):
        ops: list[Op] = [_run_region_exit(region) for region in context.chart.child_regions(leaf)]
        for each in context.chart.region_ancestors(leaf):
            if each.index == stop_index:
                break
            ops += _exit_node(context, each)
        if ops and leaf.number is not None:
            cases.append((leaf.number, tuple(ops)))
    return (Switch(mode_variable("memory.mode", node.region), tuple(cases)),) if cases else ()


def _exit_node(context: ChartContext, node: ChartNode) -> list[Op]:
    """Return the operations that leave one node: history, exit flag, timers and edges.

    Its exit action follows later as a stage.
    """
    ops: list[Op] = []
    mode = context.mode_of(node)
    if node.index in context.history_nodes:
        now = Ref(mode_variable("memory.mode", node.region), True)
        ops.append(Assign(history_ref(node).name, now if node.kind == "compound" else integer(1)))
    if mode is None:
        return ops
    if node.index in context.exit_flags:
        ops.append(Assign(context.exit_flags[node.index], Value(True)))
    if node.index not in context.timer_keeping_nodes:
        timers = [context.info_of(transition).timer for transition in mode.transitions]
        ops += [Assign(timer, integer(0)) for timer in timers if timer]
    edges = edge_detectors_by_mode(context.automaton).get(mode.key, ())
    return [*ops, *(Assign(edge.armed_variable, Value(False)) for edge in edges)]
