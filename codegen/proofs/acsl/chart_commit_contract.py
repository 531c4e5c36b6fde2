"""Chart commit contract: the active modes after the transitions of a micro-step.

A region is in the mode that the transition enters which leaves an ancestor of it: the target, its
initial mode, or the mode that a history remembers. A region that no transition leaves stays in its
mode.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import TypeAlias

from codegen.proofs.acsl.chart_conflict_contract import ConflictResolution
from codegen.proofs.acsl.chart_entry_terms import modes_after, outcomes
from codegen.proofs.acsl.chart_predicates import Configuration, all_of, any_of
from language.charts.chart_context import history_ref
from language.ir.ops import Assign
from language.ir.program import LOG_COUNT_VARIABLE, fired_variable
from language.lowering.edge_detection import edge_detectors_by_mode, start_timers
from language.lowering.event_queue import QUEUE, QUEUE_TAIL
from language.model.statechart import Chart, ChartNode, ChartTransition

Moved: TypeAlias = Callable[[ChartNode], bool]
"""A predicate of nodes: whether a node is left, or entered, in a case."""


@dataclass(frozen=True)
class Commit:
    """The contract of `commit`, and of the functions that it consists of."""

    words: Configuration

    def ensured(self) -> Iterator[str]:
        """Yield the postconditions of `commit`."""
        for part in (self._fired, self._modes, self._facts, self._raised, self.grown):
            yield from (f"ensures {said};" for said in part())

    def required(self) -> Iterator[str]:
        """Yield the preconditions."""
        yield from self.takeable()
        yield from self._counted()

    def takeable(self) -> Iterator[str]:
        """Yield that the selected transitions leave active modes, each once."""
        words = self.words
        yield from words.valid(words.now)
        yield from ConflictResolution(words).consistent(words.now)
        for region in words.charting.chart.regions:
            taken = [f"{words.now(words.chosen(region.region))} == 0"]
            for transition, way in words.charting.transitions_in(region.region):
                source = words.is_active(words.charting.chart.nodes[way.source], words.now)
                number = words.number(transition)
                own = words.is_one(words.chosen(region.region), [number], words.now)
                taken.append(f"({own} && {source})")
            yield any_of(taken)

    def grown(self) -> Iterator[str]:
        """Yield that indices of the log and of the event queue are valid.

        The queue gets no shorter.
        """
        words = self.words
        yield from self._counted()
        if any(transition.raises for transition, _ in words.charting.all_transitions):
            yield f"{words.before(QUEUE_TAIL.name)} <= {words.now(QUEUE_TAIL.name)}"

    def _counted(self) -> Iterator[str]:
        words, charting = self.words, self.words.charting
        if charting.has_several_micro_steps:
            yield f"0 <= {words.now(LOG_COUNT_VARIABLE)}"
        if any(transition.raises for transition, _ in charting.all_transitions):
            yield f"0 <= {words.now(QUEUE_TAIL.name)} <= {charting.queue_capacity}"

    def _fired(self) -> Iterator[str]:
        words = self.words
        for region in words.charting.chart.regions:
            ways = words.charting.transitions_in(region.region)
            name = fired_variable(region.region)
            for number in [words.number(transition) for transition, _ in ways]:
                told = words.place.integer_constant(name, number)
                yield f"{self._is_taken(region.region, number)} ==> {words.now(name)} == {told}"
            if ways:
                same = f"{words.now(name)} == {words.before(name)}"
                yield f"{self._is_taken(region.region, 0)} ==> {same}"

    def _modes(self) -> Iterator[str]:
        words = self.words
        for region in words.charting.chart.regions:
            for transition, way in words.charting.transitions_in(region.region):
                is_taken = self._is_taken(region.region, words.number(transition))
                for name, found in modes_after(words, transition, way).items():
                    for tests, number in outcomes(found):
                        said = f"{words.now(name)} == {number}"
                        for source in self._sources(way) if tests else [""]:
                            yield f"{all_of(filter(None, [is_taken, source, *tests]))} ==> {said}"

    def _sources(self, way: ChartTransition) -> list[str]:
        """Return the modes that a region may be in when a transition leaves it."""
        chart, words = self.words.charting.chart, self.words
        source = chart.nodes[way.source]
        numbers = [n.number for n in chart.leaves_of(source) if n.number is not None]
        return [words.is_in(source.region, [number], words.before) for number in numbers]

    def _kept(self, region: ChartNode, left: Moved) -> Iterator[str]:
        """A history keeps what its mode was in when it was left."""
        words, chart = self.words, self.words.charting.chart
        for index in sorted(words.charting.history_nodes):
            node = chart.nodes[index]
            if node.region == region.region:
                name = history_ref(node).name
                is_compound = node.kind == "compound"
                was = words.before(words.mode(node.region)) if is_compound else "1"
                yield f"{words.now(name)} == {was if left(node) else words.before(name)}"

    def _times(self, region: ChartNode, left: Moved, entered: Moved) -> Iterator[str]:
        """Counters and edges end with their mode; its time begins when it is entered."""
        words, charting = self.words, self.words.charting
        for node in charting.chart.nodes:
            mode = charting.mode_of(node)
            if mode is None or node.region != region.region:
                continue
            for way in mode.transitions if node.index not in charting.timer_keeping_nodes else ():
                timer = charting.info_of(way).timer
                if timer:
                    yield f"{words.now(timer)} == {'0' if left(node) else words.before(timer)}"
            for edge in edge_detectors_by_mode(charting.automaton).get(mode.key, ()):
                same = "\\false" if left(node) else words.before(edge.armed_variable)
                yield f"({words.now(edge.armed_variable)} <==> {same})"
            for op in start_timers(charting.automaton, mode):
                if isinstance(op, Assign):
                    same = f"({words.is_active(node, words.now)} ? 0 : {words.before(op.target)})"
                    value = same if entered(node) else words.before(op.target)
                    yield f"{words.now(op.target)} == {value}"

    def _facts(self) -> Iterator[str]:
        """Each region by what is taken around it, and by its mode if that is left: a prover that
        is given the case has nothing left to search.
        """
        words, chart = self.words, self.words.charting.chart
        for region in chart.regions:
            for case in self._cases(region):
                taken = [way for _, way in case.values() if way is not None]
                facts = [*words.valid_in(region, words.now)]
                moves = [way for way in taken if self._is_moved(region, way)]
                if not moves:
                    mode = words.mode(region.region)
                    facts.append(f"{words.now(mode)} == {words.before(mode)}")
                for mode_test, left in self._modes_left(region, moves):
                    entered = _moved_by(chart, moves)
                    more = (*self._kept(region, left), *self._times(region, left, entered))
                    said = all_of([*facts, *more])
                    tests = [self._is_taken(name, number) for name, (number, _) in case.items()]
                    yield f"{all_of([*tests, *mode_test])} ==> {said}"

    def _modes_left(
        self, region: ChartNode, moves: list[ChartTransition]
    ) -> Iterator[tuple[list[str], Moved]]:
        """Yield the modes that a region may be in, and which of its nodes are left from there."""
        words, chart = self.words, self.words.charting.chart
        moved = _moved_by(chart, moves)
        if not moves:
            yield [], moved
            return
        leaves = {leaf.number: leaf for leaf in chart.leaves(region.region)}
        inactive = words.charting.automaton.region(region.region).inactive
        numbers = [*leaves, *([] if inactive is None else [inactive])]
        for number in numbers:
            assert number is not None
            active = chart.region_ancestors(leaves[number]) if number in leaves else ()
            sources = [chart.nodes[way.source] for way in moves]
            if all(source in active for source in sources if source.region == region.region):
                yield [words.is_in(region.region, [number], words.before)], _both(moved, active)

    def _cases(self, region: ChartNode) -> Iterator[dict[str, tuple[int, ChartTransition | None]]]:
        """Yield what regions may take together, of those whose transitions move a region."""
        words, chart = self.words, self.words.charting.chart
        choices: dict[str, list[tuple[int, ChartTransition | None]]] = {}
        for other in chart.regions:
            ways = words.charting.transitions_in(other.region)
            if any(self._is_moved(region, way) for _, way in ways):
                own = [(words.number(t), w if w.domain is not None else None) for t, w in ways]
                choices[other.region] = [(0, None), *own]
        for case in product(*choices.values()):
            domains = [w.domain for _, w in case if w is not None and w.domain is not None]
            if not any(chart.are_nested(a, b) for a, b in combinations(domains, 2)):
                yield dict(zip(choices, case, strict=True))

    def _is_moved(self, region: ChartNode, way: ChartTransition) -> bool:
        """Tell whether a transition may change the mode of a region."""
        if way.domain is None:
            return False
        domain = self.words.charting.chart.nodes[way.domain]
        return domain.region == region.region or domain.contains(region.index)

    def _is_taken(self, region: str, number: int) -> str:
        name = self.words.chosen(region)
        return f"{self.words.before(name)} == {self.words.place.integer_constant(name, number)}"

    def _raised(self) -> Iterator[str]:
        """An event that a transition raises is the last one that waits; regions in turn."""
        words, charting = self.words, self.words.charting
        raising = [(t, w) for t, w in charting.all_transitions if t.raises]
        if len({charting.chart.nodes[way.source].region for _, way in raising}) != 1:
            return
        region = charting.chart.nodes[raising[0][1].source].region
        tail, queue = words.before(QUEUE_TAIL.name), words.now(QUEUE)
        for transition, _ in raising:
            more = len(transition.raises)
            is_taken = words.is_one(words.chosen(region), [words.number(transition)], words.before)
            fits = f"{is_taken} && {tail} <= {charting.queue_capacity - more}"
            yield f"({fits}) ==> {words.now(QUEUE_TAIL.name)} == {tail} + {more}"
            if more == 1:
                number = charting.chart.events[transition.raises[0]].number
                yield f"({fits}) ==> {queue}[{tail}] == {number}"
        numbers = [words.number(transition) for transition, _ in raising]
        none = words.is_one(words.chosen(region), numbers, words.before)
        yield f"{none} || {words.now(QUEUE_TAIL.name)} == {tail}"


def _moved_by(chart: Chart, moves: list[ChartTransition]) -> Moved:
    """Return whether a node is left or entered by some transitions if it is active."""

    def moved(node: ChartNode) -> bool:
        domains = [chart.nodes[way.domain] for way in moves if way.domain is not None]
        return any(domain is not node and domain.contains(node.index) for domain in domains)

    return moved


def _both(moved: Moved, active: Sequence[ChartNode]) -> Moved:
    return lambda node: node in active and moved(node)
