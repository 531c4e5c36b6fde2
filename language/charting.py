"""Charting: what the parts of a micro-step of a chart share - names, numbers, variables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from language.chart import Chart, Node, Way
from language.model import Automaton, Mode, Transition
from language.operation import Expr, Ref
from language.program import TransitionInfo

NOT_YET = -128
"""What a history holds before its mode was left once."""
FIRST = Ref("work.is_first")
OVER = Ref("work.is_over")
"""Whether a micro-step is the first of its tick; whether no further one is allowed."""


@dataclass(frozen=True)
class Charting:
    """A chart that is lowered; `now` are its names without equations, `everywhere` with them."""

    automaton: Automaton
    chart: Chart
    infos: Mapping[str, TransitionInfo]
    now: Mapping[str, Expr]
    everywhere: Mapping[str, Expr]
    size: int

    @property
    def several(self) -> bool:
        """Tell whether a tick may have more than one micro-step."""
        return self.chart.micro_steps > 1

    @property
    def may_fault(self) -> bool:
        """Tell whether a tick may reach its bound."""
        return self.several or self.size > 1

    def mode(self, node: Node) -> Mode | None:
        """Return what holds and happens in a node; None for regions of the root."""
        return self.automaton.by_key.get(node.mode)

    def info(self, way: Transition) -> TransitionInfo:
        """Return the number and timer of a transition."""
        return self.infos[way.key]

    def ways_of(self, node: Node) -> tuple[Transition, ...]:
        """Return the transitions of a node."""
        mode = self.mode(node)
        return mode.transitions if mode else ()

    def ways_in(self, region: str) -> list[tuple[Transition, Way]]:
        """Return the transitions whose source is in a region."""
        nodes = (node for node in self.chart.nodes if node.region == region)
        return [(way, self.chart.ways[way.key]) for node in nodes for way in self.ways_of(node)]

    @cached_property
    def all_ways(self) -> list[tuple[Transition, Way]]:
        """All transitions, those of outer regions first."""
        return [pair for region in self.chart.regions for pair in self.ways_in(region.region)]

    @cached_property
    def remembered(self) -> frozenset[int]:
        """The nodes of which something is kept when they are left."""
        nodes = self.chart.nodes
        found = {node.parent for node in nodes if node.kind == "history"}
        deep = [node.parent for node in nodes if node.history == "deep"]
        for transition, way in self.all_ways:
            if transition.history:
                found.update(way.targets)
                deep += way.targets if transition.history == "deep" else ()
        for outer in deep:
            inner = (r for r in self.chart.regions if nodes[outer].holds(r.index))
            found.update(region.index for region in inner if region.kind == "compound")
        return frozenset(found)

    @cached_property
    def continued(self) -> frozenset[int]:
        """The nodes that some transition may enter with their wait counters as they were."""
        found: set[int] = set()
        for transition, way in self.all_ways:
            if transition.memory == "continue" and way.domain is not None:
                domain = self.chart.nodes[way.domain]
                for node in self.chart.nodes[domain.index + 1 : domain.last + 1]:
                    if any(self.chart.nested(node.index, target) for target in way.targets):
                        found.add(node.index)
        return frozenset(found)


def ident(text: str) -> str:
    """Return a path as part of the name of a variable."""
    return text.replace(".", "_")


def wish(region: str) -> str:
    """Return the variable of the transition that a region wishes to take, 0 for none."""
    return f"work.wish_{ident(region)}"


def taken(region: str) -> str:
    """Return the variable of the transition that a region takes, 0 for none."""
    return f"work.takes_{ident(region)}"


def kept(node: Node) -> Ref:
    """Return the variable of what a node was left in."""
    return Ref(f"memory.left_{ident(node.path)}")


def leaves_flag(node: Node) -> Ref:
    """Return whether a node is left in this micro-step."""
    return Ref(f"work.exit_{ident(node.path)}")


def enters_flag(node: Node) -> Ref:
    """Return whether a node is entered in this micro-step."""
    return Ref(f"work.enter_{ident(node.path)}")
