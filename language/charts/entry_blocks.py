"""Entry sets of a chart: the nodes that a transition enters, outermost first (SCXML, entry set).

A compound node is entered at its `initial` unless a target lies inside it or its history is used. A
parallel node is entered in all of its regions (rule 15b).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from language.charts.chart_context import NEVER_LEFT, ChartContext, history_ref
from language.ir.ops import Assign, Block, Branch, Compare, Op, Switch, Value, integer
from language.ir.program import mode_variable
from language.lowering.edge_detection import start_timers
from language.lowering.transition_metadata import start_run
from language.model.automaton import Transition
from language.model.statechart import ChartNode, ChartTransition, HistoryKind


def lower_entry_set(
    context: ChartContext, transition: Transition, chart_transition: ChartTransition
) -> Block:
    """Return the operations that activate the entry set of a transition after its exits.

    First all regions inside the domain become inactive, then the nodes are activated from the
    outside in: mode variable, timers, run and entry flag. Entry actions are not included. An
    internal transition, which has no domain, has no operations.
    """
    if chart_transition.domain is None:
        return ()
    chart = context.chart
    domain = chart.nodes[chart_transition.domain]
    ops: list[Op] = []
    for region in chart.regions:
        if domain.contains(region.index) and region.index != domain.index:
            number = context.automaton.region(region.region).inactive
            assert number is not None
            ops.append(Assign(mode_variable("memory.mode", region.region), integer(number)))
    return (
        *ops,
        *_EntrySet(context, transition, chart_transition).enter_compound(
            domain, chart_transition.targets
        ),
    )


@dataclass(frozen=True)
class _EntrySet:
    """The entry set of one transition; `targets` of a method are the targets that remain."""

    context: ChartContext
    transition: Transition
    chart_transition: ChartTransition

    def enter_compound(self, node: ChartNode, targets: Iterable[int]) -> Block:
        """Return the operations that enter the children of a compound node."""
        inner = [target for target in targets if node.contains(target) and target != node.index]
        enters_history = (
            bool(self.transition.history) and node.index in self.chart_transition.targets
        )
        if not inner and enters_history:
            default = self.enter_child(node, node.initial)
            return self.enter_history(node, self.transition.history, default)
        return self.enter_child(node, inner or node.initial)

    def enter_child(self, node: ChartNode, targets: Sequence[int]) -> Block:
        """Return the operations that enter the child of a compound node that contains a target."""
        nodes = self.context.chart.nodes
        child = next(nodes[c] for c in node.children if nodes[c].contains(targets[0]))
        if child.kind == "history":
            return self.enter_history(node, child.history, self.enter_child(node, child.initial))
        return self.enter_node(child, targets)

    def enter_node(self, node: ChartNode, targets: Iterable[int]) -> Block:
        """Return the operations that enter a node and its children."""
        if node.kind == "compound":
            return (*self.activate_node(node), *self.enter_compound(node, targets))
        if node.kind == "parallel":
            return (*self.activate_node(node), *self.enter_parallel(node, targets))
        return tuple(self.activate_node(node))

    def enter_parallel(self, node: ChartNode, targets: Iterable[int]) -> Block:
        """Return the operations that enter all regions of a parallel node.

        A deep history of the transition or among the targets restores the regions as they were
        left.
        """
        nodes = self.context.chart.nodes
        targets = [target for target in targets if node.contains(target) and target != node.index]
        history = self.transition.history if node.index in self.chart_transition.targets else ""
        inner_targets: list[int] = []
        for target in targets:
            if nodes[target].kind == "history" and nodes[target].parent == node.index:
                history, inner_targets = (
                    nodes[target].history,
                    [*inner_targets, *nodes[target].initial],
                )
            else:
                inner_targets.append(target)
        regions = self.context.chart.child_regions(node)
        first = tuple(op for region in regions for op in self.enter_node(region, inner_targets))
        if history != "deep":
            return first
        again = tuple(op for region in regions for op in self.enter_deep_history(region))
        return (Branch(Compare("==", history_ref(node), integer(NEVER_LEFT)), first, again),)

    def enter_history(self, node: ChartNode, history: HistoryKind, default: Block) -> Block:
        """Return the operations that enter the mode in which a compound node was left.

        `default` is used if the node was never left. Shallow history enters the child only.
        """
        chart = self.context.chart
        cases = []
        for leaf in chart.leaves_of(node):
            chain = [
                n for n in chart.region_ancestors(leaf) if node.contains(n.index) and n is not node
            ]
            if not chain or leaf.number is None:
                continue
            ops = self.enter_node(chain[-1], ()) if history == "shallow" else self.enter_path(chain)
            cases.append((leaf.number, ops))
        never = Compare("==", history_ref(node), integer(NEVER_LEFT))
        return (Branch(never, default, (Switch(history_ref(node).name, tuple(cases)),)),)

    def enter_path(self, chain: Sequence[ChartNode]) -> Block:
        """Return the operations that enter nodes from the outermost to the innermost.

        `chain` starts with the innermost node, whose regions are restored by deep history.
        """
        ops: list[Op] = []
        for node in reversed(chain):
            ops += self.activate_node(node)
        for region in self.context.chart.child_regions(chain[0]):
            ops += self.enter_deep_history(region)
        return tuple(ops)

    def enter_deep_history(self, region: ChartNode) -> Block:
        """Return the operations that enter a region as it was left."""
        if region.kind != "compound":
            return self.enter_path([region])
        return (*self.activate_node(region), *self.enter_history(region, "deep", ()))

    def activate_node(self, node: ChartNode) -> list[Op]:
        """Return the operations that activate one node: mode variable, timers, run, entry flag.

        Its entry action follows later as a stage.
        """
        context = self.context
        ops: list[Op] = []
        mode = context.mode_of(node)
        if node.number is not None:
            variable = mode_variable("memory.mode", node.region)
            ops.append(Assign(variable, integer(node.number)))
        if mode is None:
            return ops
        if node.index in context.entry_flags:
            ops.append(Assign(context.entry_flags[node.index], Value(True)))
        if self.transition.memory == "reset" and node.index in context.timer_keeping_nodes:
            timers = [context.info_of(transition).timer for transition in mode.transitions]
            ops += [Assign(timer, integer(0)) for timer in timers if timer]
        ops += start_timers(context.automaton, mode)
        if node.number is not None:
            ops += start_run(context.automaton, mode)
        return ops
