"""Chart selection contract: the counters of a chart, and the transition that each region requests.

A region requests the first enabled transition, by priority, of the outermost or innermost of its
active modes that has one. A wait has elapsed if its guard was true in one tick more than the wait
takes. When a fault occurs, the region requests the fault mode, or nothing
(`chart_fault_contract.py`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from codegen.proofs.acsl.chart_fault_contract import ChartFault, is_of_fault
from codegen.proofs.acsl.chart_predicates import Configuration, all_of, any_of
from language.charts.chart_context import IS_FIRST_STEP, IS_STEP_LIMIT_REACHED, request_variable
from language.charts.transition_selection import choice_of_node
from language.ir.ops import Expr
from language.ir.program import TransitionInfo
from language.lowering.edge_detection import (
    EdgeDetector,
    edge_detectors_by_mode,
    edge_value_ref,
)
from language.lowering.expressions import lower_expression
from language.lowering.transition_choice import SampledChoice
from language.model.automaton import Mode, Transition
from language.model.region_queries import transitions_by_priority
from language.model.statechart import ChartNode


@dataclass(frozen=True)
class Choice:
    """The contracts of counting and choosing; guards refer to the final values."""

    words: Configuration

    def of_mode(self, node: ChartNode) -> Iterator[str]:
        """Yield the postconditions of `choose_<mode>`. Raises Unsaid."""
        name = request_variable(node.region)
        found = self._first(self._ordered([node]), self.words.before(name))
        yield f"ensures {self.words.now(name)} == {found};"

    def counted(self, node: ChartNode) -> Iterator[str]:
        """Yield the postconditions of `count_<mode>`. Raises Unsaid."""
        yield from self._counts(node, "")

    def of_region(self, region: ChartNode) -> Iterator[str]:
        """Yield the postconditions for a region: its request and the counters of its modes.

        Raises Unsaid.
        """
        words = self.words
        name, mode = request_variable(region.region), words.mode(region.region)
        leaves = words.charting.chart.leaves(region.region)
        for leaf in leaves:
            assert leaf.number is not None
            here = f"{words.now(mode)} == {words.place.integer_constant(mode, leaf.number)}"
            yield f"ensures ({here} ==> {self._requested(region, leaf)});"
        known = " || ".join(f"{words.now(mode)} == {leaf.number}" for leaf in leaves)
        yield f"ensures ({known}) || {words.now(name)} == 0;"
        sources = [f"{words.now(name)} == 0"]
        for transition, way in words.charting.transitions_in(region.region):
            own = words.is_one(name, [words.number(transition)], words.now)
            source = words.is_active(words.charting.chart.nodes[way.source], words.now)
            sources.append(f"({own} && {source})")
        yield f"ensures {any_of(sources)};"
        for node in words.charting.chart.nodes:
            if node.region == region.region and words.charting.transitions_of(node):
                active = words.is_active(node, words.now)
                yield from self._counts(node, self._unless_left(region, active))

    def _requested(self, region: ChartNode, leaf: ChartNode) -> str:
        """Return what a region requests in an innermost mode, or that a fault decides it."""
        charting, fault = self.words.charting, self._fault
        name = self.words.now(request_variable(region.region))
        chain = [n for n in charting.chart.region_ancestors(leaf) if charting.transitions_of(n)]
        ordered = chain if charting.chart.order == "inner_first" else chain[::-1]
        ways = [way for way in self._ordered(ordered) if not is_of_fault(way[-1])]
        usual = f"{name} == {self._first(ways, '0')}"
        if leaf in fault.outside:
            asked = self.words.is_one(
                request_variable(region.region), fault.numbers(leaf), self.words.now
            )
        elif fault.leaves(region):
            asked = f"{name} == 0"
        else:
            return usual
        return f"({fault.happened} ? {asked} : {usual})"

    def _unless_left(self, region: ChartNode, active: str) -> str:
        """Return when a mode counts: while it is active, and no fault leaves what is around it."""
        if not self._fault.leaves(region):
            return active
        return all_of([active, f"!{self._fault.happened}"])

    @property
    def _fault(self) -> ChartFault:
        return ChartFault(self.words)

    def _ordered(self, nodes: Iterable[ChartNode]) -> Iterator[tuple[ChartNode, int, Transition]]:
        """Yield the transitions of some modes with their index, each mode's by priority."""
        for node in nodes:
            mode = self.words.charting.mode_of(node)
            ordered = transitions_by_priority(mode) if mode else []
            yield from ((node, k, transition) for k, transition in ordered)

    def _first(self, ways: Iterable[tuple[ChartNode, int, Transition]], none: str) -> str:
        """Return the number of the first transition that is enabled."""
        found, words = none, self.words
        for node, k, transition in reversed(list(ways)):
            test = words.speech.predicate(self._choice(node).enabled[k], words.now)
            number = words.number(transition)
            told = words.place.integer_constant(request_variable(node.region), number)
            found = f"(({test}) ? {told} : {found})"
        return found

    def _choice(self, node: ChartNode) -> SampledChoice:
        return choice_of_node(self.words.charting, node, self._mode(node))

    def _mode(self, node: ChartNode) -> Mode:
        mode = self.words.charting.mode_of(node)
        assert mode
        return mode

    def _counts(self, node: ChartNode, active: str) -> Iterator[str]:
        """Yield what the counters and edges of a mode are, if that is `active`; else the same."""
        words, conditions = self.words, self._choice(node).conditions
        for k, info in enumerate(map(words.charting.info_of, self._mode(node).transitions)):
            if info.timer:
                old, new = words.before(info.timer), words.now(info.timer)
                value = self._count(info, words.speech.predicate(conditions[k], words.now), old)
                yield f"ensures {new} == {f'({active} ? {value} : {old})' if active else value};"
        automaton = self.words.charting.automaton
        for edge in edge_detectors_by_mode(automaton).get(self._mode(node).key, ()):
            said = self._edge(edge, node)
            same = f"({self._same(edge.armed_variable)})"
            yield f"ensures {f'({active} ? {said} : {same})' if active else said};"

    def _count(self, info: TransitionInfo, enabled: str, old: str) -> str:
        """A tick counts once; a wait that begins in a later micro-step begins there (rule 4)."""
        first = f"({enabled} ? ({old} < {info.timer_limit} ? {old} + 1 : {old}) : 0)"
        if not self.words.charting.has_several_micro_steps:
            return first
        later = f"({enabled} ? ({old} == 0 ? 1 : {old}) : 0)"
        over = f"({self.words.now(IS_STEP_LIMIT_REACHED.name)} ? {old} : {later})"
        return f"({self.words.now(IS_FIRST_STEP.name)} ? {first} : {over})"

    def _edge(self, edge: EdgeDetector, node: ChartNode) -> str:
        """An edge is seen where its argument turned since the last look (rule 8)."""
        words = self.words
        level = lower_expression(edge.call.arguments[0], words.charting.bindings)
        seen, old = words.now(f"work.edge_{edge.number}"), words.before(edge.armed_variable)
        if edge.is_change:
            last = edge_value_ref(words.charting.automaton, edge, f"memory.last_{edge.number}")
            text = self._text(level)
            relation = "<==>" if words.speech.is_truth_name(last.name) else "=="
            turned = f"({old} && !({text} {relation} {words.before(last.name)}))"
            left = [words.now(edge.armed_variable), f"({words.now(last.name)} {relation} {text})"]
        else:
            wanted = words.speech.predicate(level, words.now)
            wanted = f"!({wanted})" if edge.call.function == "falling" else wanted
            turned = f"(({wanted}) && {old})"
            left = [f"({words.now(edge.armed_variable)} <==> !({wanted}))"]
        looked = all_of([f"({seen} <==> {turned})", *left])
        if not words.charting.has_several_micro_steps:
            return looked
        past = f"({words.now(IS_STEP_LIMIT_REACHED.name)} && !{words.now(IS_FIRST_STEP.name)})"
        return f"({past} ? (!{seen} && {self._same(edge.armed_variable)}) : {looked})"

    def _text(self, expr: Expr) -> str:
        speech = self.words.speech
        say = speech.predicate if speech.is_truth(expr) else speech.term
        return say(expr, self.words.now)

    def _same(self, name: str) -> str:
        return f"({self.words.now(name)} <==> {self.words.before(name)})"
