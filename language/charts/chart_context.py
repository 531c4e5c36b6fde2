"""Context of the lowering of a chart: transitions, name bindings, and names of variables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from language.ir.ops import Expr, Ref
from language.ir.program import TransitionInfo
from language.model.automaton import Automaton, Mode, Transition
from language.model.statechart import Chart, ChartNode, ChartTransition

NEVER_LEFT = -128
"""The value of a history before its node was left for the first time."""
IS_FIRST_STEP = Ref("work.is_first")
"""The variable that a micro-step is the first of its tick."""
IS_STEP_LIMIT_REACHED = Ref("work.is_over")
"""The variable that no further micro-step is allowed in this tick."""


@dataclass(frozen=True)
class ChartContext:
    """A chart to lower, with its transitions and name bindings.

    `base_bindings` are the expressions of names without equations, `bindings` those with equations.
    `transition_infos` are by the key path of a transition.
    """

    automaton: Automaton
    chart: Chart
    transition_infos: Mapping[str, TransitionInfo]
    base_bindings: Mapping[str, Expr]
    bindings: Mapping[str, Expr]
    queue_capacity: int

    @property
    def has_several_micro_steps(self) -> bool:
        """Whether a tick may have more than one micro-step (`micro_steps` of the chart)."""
        return self.chart.micro_steps > 1

    @property
    def may_reach_limit(self) -> bool:
        """Whether a tick may end before all events or transitions are processed.

        This is so with several micro-steps or with more than one place in the event queue.
        """
        return self.has_several_micro_steps or self.queue_capacity > 1

    def mode_of(self, node: ChartNode) -> Mode | None:
        """Return the mode of a node, with its actions and transitions.

        The result is None for a node without one, such as the root of a region or a history node.
        """
        return self.automaton.modes_by_key.get(node.mode_key)

    @cached_property
    def exit_flags(self) -> Mapping[int, str]:
        """The variable of `exit_flag` by the index of each node that has an exit action."""
        nodes = ((node, self.mode_of(node)) for node in self.chart.nodes)
        return {node.index: exit_flag(node).name for node, mode in nodes if mode and mode.exit}

    @cached_property
    def entry_flags(self) -> Mapping[int, str]:
        """The variable of `entry_flag` by the index of each node that has an entry action."""
        nodes = ((node, self.mode_of(node)) for node in self.chart.nodes)
        return {node.index: entry_flag(node).name for node, mode in nodes if mode and mode.entry}

    def info_of(self, transition: Transition) -> TransitionInfo:
        """Return the number, timer and other data of a transition, by its key path."""
        return self.transition_infos[transition.key]

    def transitions_of(self, node: ChartNode) -> tuple[Transition, ...]:
        """Return the transitions that leave a node in file order; empty without a mode."""
        mode = self.mode_of(node)
        return mode.transitions if mode else ()

    def transitions_in(self, region: str) -> list[tuple[Transition, ChartTransition]]:
        """Return the transitions whose source node is in a region, each with its chart endpoints.

        They are in the order of the nodes; nested regions are not included.
        """
        nodes = (node for node in self.chart.nodes if node.region == region)
        return [
            (transition, self.chart.transitions[transition.key])
            for node in nodes
            for transition in self.transitions_of(node)
        ]

    @cached_property
    def all_transitions(self) -> list[tuple[Transition, ChartTransition]]:
        """The transitions of all regions, outer regions first."""
        return [
            pair for region in self.chart.regions for pair in self.transitions_in(region.region)
        ]

    @cached_property
    def history_nodes(self) -> frozenset[int]:
        """The indices of the nodes whose active child is stored when they are left.

        They have a history node or are targets of a transition with `history`; deep history adds
        the compound regions inside.
        """
        nodes = self.chart.nodes
        found = {node.parent for node in nodes if node.kind == "history"}
        deep = [node.parent for node in nodes if node.history == "deep"]
        for transition, chart_transition in self.all_transitions:
            if transition.history:
                found.update(chart_transition.targets)
                deep += chart_transition.targets if transition.history == "deep" else ()
        for outer in deep:
            inner = (r for r in self.chart.regions if nodes[outer].contains(r.index))
            found.update(region.index for region in inner if region.kind == "compound")
        return frozenset(found)

    @cached_property
    def timer_keeping_nodes(self) -> frozenset[int]:
        """The indices of the nodes that a transition with `memory: continue` may enter.

        They are the nodes inside its domain that contain a target or lie inside one. Their wait
        counters are kept when they are left.
        """
        found: set[int] = set()
        for transition, chart_transition in self.all_transitions:
            if transition.memory == "continue" and chart_transition.domain is not None:
                domain = self.chart.nodes[chart_transition.domain]
                for node in self.chart.nodes[domain.index + 1 : domain.last_descendant + 1]:
                    if any(
                        self.chart.are_nested(node.index, target)
                        for target in chart_transition.targets
                    ):
                        found.add(node.index)
        return frozenset(found)


def to_identifier(text: str) -> str:
    """Return a path with `_` for each dot, as part of a variable's name."""
    return text.replace(".", "_")


def request_variable(region: str) -> str:
    """Return `work.request_<region>`, the number of the transition that a region requests, or 0."""
    return f"work.request_{to_identifier(region)}"


def selected_variable(region: str) -> str:
    """Return `work.selected_<region>`, the number of the transition that a region takes, or 0."""
    return f"work.selected_{to_identifier(region)}"


def history_ref(node: ChartNode) -> Ref:
    """Return `memory.left_<node>`, the mode that was active in a node when it was last left.

    Its value is `NEVER_LEFT` before that. For a node that is not compound it is 1 after that.
    """
    return Ref(f"memory.left_{to_identifier(node.path)}")


def exit_flag(node: ChartNode) -> Ref:
    """Return `work.exit_<node>`, whether a node is left in this micro-step."""
    return Ref(f"work.exit_{to_identifier(node.path)}")


def entry_flag(node: ChartNode) -> Ref:
    """Return `work.enter_<node>`, whether a node is entered in this micro-step."""
    return Ref(f"work.enter_{to_identifier(node.path)}")
