"""Chart step contract: the effect of a micro-step, and of the jump of a tick, on the active modes.

Before and after, each active region has one active mode. No mode changes if no transition is taken.
When a fault occurs, the fault mode is entered from all modes outside of it. A tick ends if no
transition is taken and no event waits, or at its bound (rules 7, 15 and 18). The parts of a
micro-step in the copy that is proven have lemmas.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from codegen.proofs.acsl.chart_commit_contract import Commit
from codegen.proofs.acsl.chart_entry_terms import modes_after, outcomes
from codegen.proofs.acsl.chart_fault_contract import ChartFault
from codegen.proofs.acsl.chart_predicates import Configuration, all_of, any_of
from language.charts.chart_context import IS_FIRST_STEP, IS_STEP_LIMIT_REACHED
from language.charts.micro_step import HAS_NEXT_STEP, STEP_COUNT
from language.ir.program import LOG_COUNT_VARIABLE
from language.ir.root_region import CHART
from language.lowering.event_queue import CURRENT_EVENT, QUEUE_HEAD, QUEUE_TAIL
from language.model.automaton import Transition
from language.model.statechart import ChartTransition


@dataclass(frozen=True)
class Step:
    """The contract of a micro-step, also if a jump consists of one."""

    words: Configuration

    def required(self) -> Iterator[str]:
        """Yield the preconditions of a micro-step: a valid configuration and valid indices."""
        yield from self.words.valid(self.words.now)
        yield from self.places()
        yield self.words.now(HAS_NEXT_STEP.name)

    def ensured(self) -> Iterator[str]:
        """Yield the postconditions of a micro-step."""
        yield from self.moved()
        if self.words.charting.has_several_micro_steps and self.words.knows(IS_FIRST_STEP.name):
            yield f"!{self.words.now(IS_FIRST_STEP.name)}"

    def moved(self) -> Iterator[str]:
        """Yield the postconditions after the selected transitions were executed."""
        words = self.words
        yield from words.valid(words.now)
        yield from self.places()
        yield from (f"({self._free} ==> ({said}))" for said in self._faults())
        for region in words.charting.chart.regions:
            mode = words.mode(region.region)
            stays = f"{words.now(mode)} == {words.before(mode)}"
            yield f"(!({self._free} && {self.fired}) ==> {stays})"
        if words.charting.has_several_micro_steps:
            yield from self._progress()

    def chosen(self) -> Iterator[str]:
        """Yield the lemma on the selected transitions, after conflicts are resolved."""
        words, fault = self.words, ChartFault(self.words)
        yield from Commit(words).takeable()
        for leaf in fault.outside:
            assert leaf.number is not None
            here = words.is_in(CHART, [leaf.number], words.now)
            asked = words.is_one(words.chosen(CHART), fault.numbers(leaf), words.now)
            yield f"(({fault.happened} && {here}) ==> {asked})"

    def taking(self) -> Iterator[str]:
        """Yield the preconditions of the execution of the selected transitions."""
        yield from self.required()
        yield from self.chosen()
        yield self.fired

    def committed(self) -> Iterator[str]:
        """Yield the lemma on the active modes after the selected transitions were executed."""
        fault = ChartFault(self.words)
        yield from self.words.valid(self.words.now)
        yield from Commit(self.words).grown()
        for transition, way in (pair for leaf in fault.outside for pair in fault.ways(leaf)):
            taken, entered = self._is_taken(CHART, transition), self._entered(transition, way)
            yield f"({taken} ==> {entered})"

    def places(self) -> Iterator[str]:
        """Yield the bounds of log and queue indices, and of the number of micro-steps."""
        words, charting = self.words, self.words.charting
        if charting.has_several_micro_steps:
            steps, most = words.now(STEP_COUNT.name), charting.chart.micro_steps
            yield f"0 <= {words.now(LOG_COUNT_VARIABLE)}"
            yield f"0 <= {steps} <= {most}"
            yield f"({words.now(IS_STEP_LIMIT_REACHED.name)} <==> {steps} == {most})"
        if charting.queue_capacity:
            head, tail = words.now(QUEUE_HEAD.name), words.now(QUEUE_TAIL.name)
            yield f"0 <= {head} <= {tail} <= {charting.queue_capacity}"

    @property
    def fired(self) -> str:
        """The predicate that at least one transition is taken."""
        words = self.words
        regions = [
            r for r in words.charting.chart.regions if words.charting.transitions_in(r.region)
        ]
        return any_of(f"{words.now(words.chosen(r.region))} != 0" for r in regions)

    @property
    def _free(self) -> str:
        """That the bound of the tick was not reached."""
        words = self.words
        return (
            f"!{words.before(IS_STEP_LIMIT_REACHED.name)}"
            if words.charting.has_several_micro_steps
            else "\\true"
        )

    def _is_taken(self, region: str, transition: Transition) -> str:
        words = self.words
        return words.is_one(words.chosen(region), [words.number(transition)], words.now)

    def _faults(self) -> Iterator[str]:
        """Yield that the fault mode is entered from all modes outside of it."""
        words, fault = self.words, ChartFault(self.words)
        for leaf in fault.outside:
            assert leaf.number is not None
            here = words.is_in(CHART, [leaf.number], words.before)
            asked = f"{fault.happened} && {here}"
            found = (
                all_of([self._is_taken(CHART, transition), self._entered(transition, way)])
                for transition, way in fault.ways(leaf)
            )
            yield f"({asked}) ==> {any_of(found)}"

    def _entered(self, transition: Transition, way: ChartTransition) -> str:
        """Return that the modes are active that a transition enters."""
        words, said = self.words, []
        for name, found in modes_after(words, transition, way).items():
            for tests, number in outcomes(found):
                end = f"{words.now(name)} == {number}"
                said.append(f"({all_of(tests)} ==> {end})" if tests else end)
        return all_of(said)

    def _progress(self) -> Iterator[str]:
        """Yield how far the tick is: steps, events, whether another turn follows."""
        words, now, before = self.words, self.words.now, self.words.before
        steps = before(STEP_COUNT.name)
        yield f"{now(STEP_COUNT.name)} == ({self.fired} && {self._free} ? {steps} + 1 : {steps})"
        if not words.charting.queue_capacity:
            yield self._goes_on(f"{self.fired} && {self._free}")
            return
        head, event = before(QUEUE_HEAD.name), before(CURRENT_EVENT.name)
        waits = f"{head} < {before(QUEUE_TAIL.name)}"
        yield self._goes_on(f"({self.fired} || {waits}) && {self._free}")
        hears, moves = f"!{self.fired} && {waits} && {self._free}", f"{self.fired} && {self._free}"
        yield f"{now(QUEUE_HEAD.name)} == ({hears} ? {head} + 1 : {head})"
        yield f"(({moves}) ==> {now(CURRENT_EVENT.name)} == 0)"
        yield f"({moves} || {hears} || {now(CURRENT_EVENT.name)} == {event})"
        yield f"{before(QUEUE_TAIL.name)} <= {now(QUEUE_TAIL.name)}"
        yield f"({self.fired} || {now(QUEUE_TAIL.name)} == {before(QUEUE_TAIL.name)})"

    def _goes_on(self, test: str) -> str:
        """Return when another turn follows; one that is made follows one that was."""
        busy = self.words.now(HAS_NEXT_STEP.name)
        return f"({test} ? {busy} : !{busy})"


@dataclass(frozen=True)
class Jump:
    """The contract of the jump of a tick."""

    words: Configuration

    @property
    def _step(self) -> Step:
        return Step(self.words)

    def required(self) -> Iterator[str]:
        """Yield the precondition: a valid configuration."""
        yield from self.words.valid(self.words.now)

    def ensured(self) -> Iterator[str]:
        """Yield the postconditions of a jump."""
        if not self.words.charting.has_several_micro_steps:
            yield from self._step.ensured()
            return
        yield from self.words.valid(self.words.now)
        yield from self._step.places()
        yield f"!{self.words.now(HAS_NEXT_STEP.name)}"
        yield self._ended()

    def turns(self) -> Iterator[str]:
        """Yield the loop invariants."""
        words, charting = self.words, self.words.charting
        if not charting.has_several_micro_steps:
            return
        yield from words.valid(words.now)
        yield from self._step.places()
        yield f"({words.now(HAS_NEXT_STEP.name)} || {self._ended()})"
        done = words.now(STEP_COUNT.name)
        if charting.queue_capacity:
            head = words.now(QUEUE_HEAD.name)
            done += f" + {head} - \\at({head}, LoopEntry)"
            yield f"0 <= \\at({head}, LoopEntry)"
        yield f"({words.now(HAS_NEXT_STEP.name)} ==> turn == {done})"

    def _ended(self) -> str:
        """Return that nothing is left to do, or no further micro-step is allowed."""
        words = self.words
        rests = [f"!{self._step.fired}"]
        if words.charting.queue_capacity:
            rests.append(f"{words.now(QUEUE_HEAD.name)} == {words.now(QUEUE_TAIL.name)}")
        return any_of([words.now(IS_STEP_LIMIT_REACHED.name), all_of(rests)])
