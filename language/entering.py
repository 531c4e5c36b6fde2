"""Entering: which nodes of a chart a transition enters, from the outside in (SCXML's entry set).

A compound node is entered at its `initial` unless a target lies inside it or its history is asked
for; a parallel one in all of its regions (rule 15b).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from language.activation import begin
from language.chart import Keeping, Node, Way
from language.charting import NOT_YET, Charting, enters_flag, kept
from language.model import Transition
from language.operation import Assign, Block, Branch, Choose, Compare, Op, Value, whole
from language.program import mode_variable
from language.transition import enter_run


def entering(charting: Charting, transition: Transition, way: Way) -> Block:
    """Return what enters the targets of a transition, once it has left what it leaves."""
    if way.domain is None:
        return ()
    chart = charting.chart
    domain = chart.nodes[way.domain]
    ops: list[Op] = []
    for region in chart.regions:
        if domain.holds(region.index) and region.index != domain.index:
            number = charting.automaton.region(region.region).inactive
            assert number is not None
            ops.append(Assign(mode_variable("memory.mode", region.region), whole(number)))
    return (*ops, *_Entry(charting, transition, way).inside(domain, way.targets))


@dataclass(frozen=True)
class _Entry:
    """One transition that enters; `wanted` are always the targets that are not reached yet."""

    charting: Charting
    transition: Transition
    way: Way

    def inside(self, node: Node, wanted: Iterable[int]) -> Block:
        """Enter what is inside a compound node."""
        inner = [target for target in wanted if node.holds(target) and target != node.index]
        asked = bool(self.transition.history) and node.index in self.way.targets
        if not inner and asked:
            usual = self.inside_at(node, node.initial)
            return self.recalled(node, self.transition.history, usual)
        return self.inside_at(node, inner or node.initial)

    def inside_at(self, node: Node, wanted: Sequence[int]) -> Block:
        """Enter the child of a compound node that holds what is wanted."""
        nodes = self.charting.chart.nodes
        child = next(nodes[c] for c in node.children if nodes[c].holds(wanted[0]))
        if child.kind == "history":
            return self.recalled(node, child.history, self.inside_at(node, child.initial))
        return self.enter(child, wanted)

    def enter(self, node: Node, wanted: Iterable[int]) -> Block:
        """Enter a node and what is inside it."""
        if node.kind == "compound":
            return (*self.at(node), *self.inside(node, wanted))
        if node.kind == "parallel":
            return (*self.at(node), *self.side_by_side(node, wanted))
        return tuple(self.at(node))

    def side_by_side(self, node: Node, wanted: Iterable[int]) -> Block:
        """Enter all regions of a parallel node; a history among its children tells where."""
        nodes = self.charting.chart.nodes
        wanted = [target for target in wanted if node.holds(target) and target != node.index]
        asked = self.transition.history if node.index in self.way.targets else ""
        usual: list[int] = []
        for target in wanted:
            if nodes[target].kind == "history" and nodes[target].parent == node.index:
                asked, usual = nodes[target].history, [*usual, *nodes[target].initial]
            else:
                usual.append(target)
        regions = self.charting.chart.inner_regions(node)
        first = tuple(op for region in regions for op in self.enter(region, usual))
        if asked != "deep":
            return first
        again = tuple(op for region in regions for op in self.deep(region))
        return (Branch(Compare("==", kept(node), whole(NOT_YET)), first, again),)

    def recalled(self, node: Node, how: Keeping, usual: Block) -> Block:
        """Enter what a compound node was left in, or what is usual where it never was."""
        chart = self.charting.chart
        cases = []
        for leaf in chart.leaves_of(node):
            chain = [n for n in chart.chain(leaf) if node.holds(n.index) and n is not node]
            if not chain or leaf.number is None:
                continue
            ops = self.enter(chain[-1], ()) if how == "shallow" else self.path(chain)
            cases.append((leaf.number, ops))
        never = Compare("==", kept(node), whole(NOT_YET))
        return (Branch(never, usual, (Choose(kept(node).name, tuple(cases)),)),)

    def path(self, chain: Sequence[Node]) -> Block:
        """Enter the nodes down to an innermost one, with all that was active inside that."""
        ops: list[Op] = []
        for node in reversed(chain):
            ops += self.at(node)
        for region in self.charting.chart.inner_regions(chain[0]):
            ops += self.deep(region)
        return tuple(ops)

    def deep(self, region: Node) -> Block:
        """Enter a region as it was left."""
        if region.kind != "compound":
            return self.path([region])
        return (*self.at(region), *self.recalled(region, "deep", ()))

    def at(self, node: Node) -> list[Op]:
        """What entering one node means at once; its entry comes as a stage."""
        charting = self.charting
        ops: list[Op] = []
        mode = charting.mode(node)
        if node.number is not None:
            variable = mode_variable("memory.mode", node.region)
            ops.append(Assign(variable, whole(node.number)))
        if mode is None:
            return ops
        if mode.entry:
            ops.append(Assign(enters_flag(node).name, Value(True)))
        if self.transition.memory == "reset" and node.index in charting.continued:
            timers = [charting.info(way).timer for way in mode.transitions]
            ops += [Assign(timer, whole(0)) for timer in timers if timer]
        ops += begin(charting.automaton, mode)
        if node.number is not None:
            ops += enter_run(charting.automaton, mode)
        return ops
