"""Check for dead transitions: warns of guards that never hold, are shadowed, or wait in vain.

It also warns of modes that cannot be left and of waits that differ by less than a period (rule 10).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from fractions import Fraction

from language.ir.ops import Compare, Expr, Ref, Unary, Value, integer, real
from language.lowering.constants import wait_seconds
from language.lowering.wait_ticks import seconds_to_ticks, tunable_wait, wait_range_in_ticks
from language.model.automaton import Automaton, Mode, Transition
from language.model.declaration import Formula, Range
from language.model.region_queries import transitions_by_priority
from language.model.transition_precedence import (
    covers_events,
    inner_preceding_transitions,
    is_guard_portable,
    possible_events,
    preceding_transitions,
)
from language.readers.transition_table_reader import STAY
from language.smt.query_engine import QueryEngine
from language.smt.symbolic_environment import TIME_IN_MODE, GuardSnapshot
from language.text.diagnostic import Problems, Span, SpecError

PRIORITY_HINT = "give it a smaller priority, or "
"""Start of the hint for a transition that another one of the same mode precedes."""
ORDER_HINT = "let the other guard exclude it, choose the other `order`, or "
"""Start of the hint for a transition that one of an enclosing or inner mode precedes."""


def check_dead_transitions(
    automaton: Automaton, query_engine: QueryEngine, problems: Problems
) -> set[str]:
    """Warn of transitions that never fire; return their keys.

    A transition never fires if no transition raises its events and none is an input, if its guard
    never holds within the declared ranges, or if transitions of higher precedence always fire
    first. Only what is proven is reported. A completion that never holds is left to `check_chart`.
    """
    dead_transitions: set[str] = set()
    for mode in automaton.all_modes:
        guards = _ModeGuards(automaton, mode, query_engine)
        for _, transition in transitions_by_priority(mode):
            if _waits_for_unraised_event(automaton, transition):
                names = " or ".join(f"`{name}`" for name in transition.events)
                label = f"this never fires: nothing raises {names}, and no input is it"
                event = transition.events[0]
                hint = (
                    f"`raise: {event}` on a transition, or `events: {{{event}: {{from: input}}}}`"
                )
                problems.warning("dead", transition.span, label, hint)
                dead_transitions.add(transition.key)
                continue
            if guards.report_inner_shadow(transition, problems):
                dead_transitions.add(transition.key)
                continue
            if not guards.never_fires(transition):
                continue
            if guards.never_holds(transition):
                if transition.is_completion:
                    continue  # language/checks/check_chart.py reports it
                label = f"{_describe_guard(transition)} never holds within the declared ranges"
                hint = "they exclude it, with the equations of the mode: correct one of them"
                problems.warning("dead", _span_of(transition, transition.when), label, hint)
            elif not guards.report_shadow(transition, problems):
                continue
            dead_transitions.add(transition.key)
    return dead_transitions


def _waits_for_unraised_event(automaton: Automaton, transition: Transition) -> bool:
    """Return whether a transition has events and none of them can occur."""
    return bool(transition.events) and not possible_events(automaton) & {*transition.events}


def check_close_waits(automaton: Automaton, query_engine: QueryEngine, problems: Problems) -> None:
    """Warn of two waits of a mode that differ by less than a period, but are not equal (rule 10).

    Waits of 0, tunable waits and transitions with guards that are proven exclusive are left out. A
    continuous automaton is skipped. The warning is placed at the later wait in the file.
    """
    if automaton.period is None:
        return
    for mode in automaton.all_modes:
        guards = _ModeGuards(automaton, mode, query_engine)
        for earlier, later in _waiting_pairs(mode):
            if any(tunable_wait(automaton, transition.wait) for transition in (earlier, later)):
                continue
            first, second = (wait_seconds(transition, automaton) for transition in (earlier, later))
            difference = abs(first - second)
            if first and second and 0 < difference < automaton.period:
                if guards.are_exclusive(earlier, later):
                    continue
                times = [f"{float(time) * 1e3:g} ms" for time in (second, first, automaton.period)]
                label = f"{times[0]} are nearer to the {times[1]} of `{earlier.name}` "
                label += f"than a period of {times[2]}"
                hint = "both may elapse in the same tick; then the smaller `priority` fires"
                assert later.wait
                problems.warning("near", _span_of(later, later.wait), label, hint)


def check_stuck_modes(automaton: Automaton, dead_transitions: set[str], problems: Problems) -> None:
    """Warn of modes whose transitions are all dead, those of enclosing modes included.

    `dead_transitions` are key paths. Superstates, and modes without any transition of their own or
    of an enclosing mode, are left out.
    """
    superstates = {mode.key for mode in automaton.superstates}
    for mode in automaton.all_modes:
        transitions = [
            transition
            for each in _enclosing_modes(automaton, mode)
            for transition in each.transitions
        ]
        if (
            mode.key not in superstates
            and transitions
            and all(transition.key in dead_transitions for transition in transitions)
        ):
            label = f"mode `{mode.name}` cannot be left: none of its transitions ever fires"
            problems.warning("stuck", mode.span, label)


def _enclosing_modes(automaton: Automaton, mode: Mode) -> Iterator[Mode]:
    """Yield a mode and the modes of a chart that enclose it."""
    yield mode
    chart = automaton.statechart
    own_node = next(node for node in chart.nodes if node.mode_key == mode.key) if chart else None
    for node in chart.ancestors(own_node) if chart and own_node else ():
        if node.mode_key != mode.key and node.mode_key in automaton.modes_by_key:
            yield automaton.modes_by_key[node.mode_key]


class _ModeGuards:
    """Lowered guards and waits of one mode in a snapshot."""

    def __init__(self, automaton: Automaton, mode: Mode, query_engine: QueryEngine) -> None:
        self.automaton = automaton
        self.mode = mode
        self.query_engine = query_engine
        self.snapshot = GuardSnapshot(automaton, mode)
        self.guards: dict[str, Expr | None] = {}
        self.waits: dict[str, Fraction] = {}
        for transition in mode.transitions:
            self.guard_of(transition)

    def guard_of(self, transition: Transition) -> Expr | None:
        """Return the lowered guard of a transition; None if it cannot be lowered."""
        if transition.key not in self.guards:
            self.guards[transition.key] = None
            with suppress(KeyError, SpecError):
                self.guards[transition.key] = self._lower_guard(transition)
        return self.guards[transition.key]

    def wait_of(self, transition: Transition) -> Fraction:
        """Return the longest wait of a transition: ticks if the automaton is sampled, else [s].

        The wait is 0 without `wait`.
        """
        if transition.key not in self.waits:
            self.waits[transition.key] = _wait_range(self.automaton, transition)[1]
        return self.waits[transition.key]

    def _lower_guard(self, transition: Transition) -> Expr | None:
        """Return the guard, also that of a transition of an enclosing mode.

        It is None if that guard depends on the enclosing mode.
        """
        source = self.automaton.source_mode(transition)
        if source.key == self.mode.key:
            return self.snapshot.lower_guard(transition)
        if not is_guard_portable(transition):
            return None
        return self.snapshot.in_enclosing_mode(source).lower_guard(transition)

    def are_incompatible(self, *conditions: Expr | None) -> bool:
        """Return whether it is proven that conditions never hold together, for all tunable values.

        The result is False if a condition is None.
        """
        known = [condition for condition in conditions if condition is not None]
        if len(known) < len(conditions):
            return False
        return self.query_engine.is_proven_unsatisfiable(
            self.query_engine.build_query(self.snapshot.path, known)
        )

    def report_inner_shadow(self, transition: Transition, problems: Problems) -> bool:
        """Warn of a transition of a superstate that an inner transition always precedes.

        Return whether this was proven for every inner mode.
        """
        inner_transitions = list(inner_preceding_transitions(self.automaton, self.mode))
        wait = self.wait_of(transition)
        for leaf, transitions in inner_transitions:
            inside = _ModeGuards(self.automaton, leaf, self.query_engine)
            first = [each for each in transitions if not self.wait_of(each)]
            first = [each for each in first if covers_events(self.automaton, each, transition)]
            others = [_negate(guard) for guard in map(inside.guard_of, first) if guard is not None]
            if not others or not inside.are_incompatible(inside.guard_of(transition), *others):
                return False
        what = "one of the transitions inside, which win by `order`, fires"
        return bool(inner_transitions) and _report_shadow(
            transition, what, bool(wait), problems, ORDER_HINT
        )

    def never_fires(self, transition: Transition) -> bool:
        """Return whether it is proven that a guard never holds unless an earlier guard does.

        This single query excludes most transitions from the search for the reason.
        """
        wait = self.wait_of(transition)
        others = (_negate(self.guard_of(each)) for each in self._earlier_transitions(transition))
        return self.are_incompatible(self.guard_of(transition), *self._active_for(wait), *others)

    def never_holds(self, transition: Transition) -> bool:
        """Return whether it is proven that a guard never holds."""
        return self.are_incompatible(self.guard_of(transition))

    def are_exclusive(self, first: Transition, second: Transition) -> bool:
        """Return whether it is proven that two guards never hold together."""
        return self.are_incompatible(self.guard_of(first), self.guard_of(second))

    def report_shadow(self, transition: Transition, problems: Problems) -> bool:
        """Warn of a transition that one or several others always precede; return whether it was so.

        A single transition that precedes is named; otherwise the set of those without wait is.
        """
        guard = self.guard_of(transition)
        if guard is None:
            return False
        before = {each.key for each in preceding_transitions(self.automaton, self.mode, transition)}
        wait = _wait_range(self.automaton, transition)[0]
        first = self._earlier_transitions(transition)
        at_once = [each for each in first if each.key in before and not self.wait_of(each)]
        lasted = self._active_for(wait)
        for each in first:
            own = self._active_for(wait - self.wait_of(each)) if each.key in before else ()
            if self.are_incompatible(guard, *own, _negate(self.guard_of(each))):
                what, hint = f"`{each.name}` fires", PRIORITY_HINT
                if each.source != transition.source:
                    what, hint = (
                        f"`{each.name}` of `{each.source}`, which is around it, fires",
                        ORDER_HINT,
                    )
                return _report_shadow(transition, what, bool(wait), problems, hint)
        others = [_negate(self.guard_of(each)) for each in at_once]
        if len(others) > 1 and self.are_incompatible(guard, *lasted, *others):
            names = ", ".join(f"`{each.name}`" for each in at_once)
            what = f"one of {names} fires"
            return _report_shadow(transition, what, bool(wait), problems, PRIORITY_HINT)
        return False

    def _earlier_transitions(self, transition: Transition) -> list[Transition]:
        """Return the transitions that fire first whenever both guards hold from the same time on.

        Only transitions with a lowered guard are returned.
        """
        wait = _wait_range(self.automaton, transition)[0]
        before = {
            each.key: each for each in preceding_transitions(self.automaton, self.mode, transition)
        }
        own = self.mode.transitions
        along = {each.key: each for each in own if covers_events(self.automaton, each, transition)}
        transitions = {**along, **before}.values()
        return [
            each
            for each in transitions
            if self.guard_of(each) is not None and self._fires_before(each, before, wait)
        ]

    def _fires_before(
        self, other: Transition, before: Mapping[str, Transition], wait: Fraction
    ) -> bool:
        """Return whether a transition fires before one with a given wait.

        `before` has the transitions of higher precedence by their keys.
        """
        other_wait = self.wait_of(other)
        if not wait:
            return not other_wait and other.key in before
        leaves = bool(other.targets) and not other.internal
        return (leaves and other_wait < wait) or (other_wait == wait and other.key in before)

    def _active_for(self, wait: Fraction) -> tuple[Expr, ...]:
        """Return the condition that the mode has been active for a wait.

        It is empty if the wait is 0 or no guard reads the time in the mode.
        """
        if not wait or TIME_IN_MODE not in self.snapshot.path.domains:
            return ()
        is_sampled = self.automaton.is_sampled
        limit = integer(int(wait)) if is_sampled else real(wait)
        return (Compare(">=", Ref(TIME_IN_MODE, is_sampled), limit),)


def _report_shadow(
    transition: Transition, what: str, waits: bool, problems: Problems, hint: str
) -> bool:
    """Warn that other transitions precede one; the place is its wait if it waits. Returns True."""
    other = f"write `{STAY}`" if transition.is_table_cell else "remove it"
    if waits:
        label = f"this wait never elapses: {what} before, whenever the guard holds"
        assert transition.wait
        place = _span_of(transition, transition.wait)
        problems.warning("timer", place, label, f"wait for less, or {other}")
    else:
        label = f"this never fires: {what} first, whenever {_describe_guard(transition)} holds"
        problems.warning("shadowed", _span_of(transition, transition.when), label, hint + other)
    return True


def _span_of(transition: Transition, formula: Formula) -> Span:
    """Return the place of a formula.

    For a transition table the cell, because rows share formulas.
    """
    return transition.span if transition.is_table_cell else formula.span


def _describe_guard(transition: Transition) -> str:
    """Return the subject of a message about a guard."""
    return f"the guard of `{transition.name}`" if transition.is_table_cell else "this"


def _wait_range(automaton: Automaton, transition: Transition) -> Range:
    """Return the shortest and longest wait: ticks if the automaton is sampled, else [s]."""
    tunable = tunable_wait(automaton, transition.wait)
    if tunable:
        return wait_range_in_ticks(automaton, automaton.parameters[tunable])
    wait = wait_seconds(transition, automaton)
    exact = Fraction(seconds_to_ticks(automaton, wait)) if automaton.period else wait
    return exact, exact


def _waiting_pairs(mode: Mode) -> Iterator[tuple[Transition, Transition]]:
    """Yield each pair of transitions of a mode that both have a wait."""
    waiting = [transition for transition in mode.transitions if transition.wait]
    for position, later in enumerate(waiting):
        for earlier in waiting[:position]:
            yield earlier, later


def _negate(condition: Expr | None) -> Expr | None:
    """Return the negation of a condition; a literal is negated directly, None remains None."""
    if isinstance(condition, Value):
        return Value(not condition.value)
    return None if condition is None else Unary("not", condition)
