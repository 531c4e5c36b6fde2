"""Check of transitions: what never fires - dead, shadowed, a wait that never elapses - and waits
that are nearer to each other than a period. Warnings: nothing of it is ambiguous.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from fractions import Fraction

from language.constants import exact_value
from language.declaration import Formula, Range
from language.inquiry import Inquiry
from language.model import Automaton, Mode, Transition
from language.moment import ELAPSED, Moment
from language.operation import Compare, Expr, Ref, Unary, Value, real, whole
from language.precedence import (
    comes_along,
    events_that_come,
    inside_first,
    means_the_same,
    winners,
)
from language.problem import Problems, Span, SpecError
from language.region import by_priority
from language.transition_table import STAY
from language.wait import range_in_ticks, ticks_of, tunable_wait

BY_PRIORITY = "give it a smaller priority, or "
BY_ORDER = "let the other guard exclude it, choose the other `order`, or "


def check_transitions(automaton: Automaton, inquiry: Inquiry, problems: Problems) -> set[str]:
    """Warn of transitions that never fire; return the keys of them."""
    silent: set[str] = set()
    for mode in automaton.all_modes:
        guards = _Guards(automaton, mode, inquiry)
        for _, transition in by_priority(mode):
            if _never_raised(automaton, transition):
                names = " or ".join(f"`{name}`" for name in transition.events)
                label = f"this never fires: nothing raises {names}, and no input is it"
                one = transition.events[0]
                hint = f"`raise: {one}` on a transition, or `events: {{{one}: {{from: input}}}}`"
                problems.warning("dead", transition.span, label, hint)
                silent.add(transition.key)
                continue
            if guards.is_first_inside(transition, problems):
                silent.add(transition.key)
                continue
            if not guards.is_silent(transition):
                continue
            if guards.never(transition):
                if transition.completes:
                    continue  # language/check_chart.py
                label = f"{_guard(transition)} never holds within the declared ranges"
                hint = "they exclude it, with the equations of the mode: correct one of them"
                problems.warning("dead", _place(transition, transition.when), label, hint)
            elif not guards.report_shadow(transition, problems):
                continue
            silent.add(transition.key)
    return silent


def _never_raised(automaton: Automaton, transition: Transition) -> bool:
    """Tell whether a transition waits for events that never come."""
    return bool(transition.events) and not events_that_come(automaton) & {*transition.events}


def check_waits(automaton: Automaton, inquiry: Inquiry, problems: Problems) -> None:
    """Warn of two waits that differ by less than a period (rule 10)."""
    if automaton.period is None:
        return
    for mode in automaton.all_modes:
        guards = _Guards(automaton, mode, inquiry)
        for earlier, later in _pairs(mode):
            if any(tunable_wait(automaton, way.wait) for way in (earlier, later)):
                continue
            first, second = (_wait(automaton, way) for way in (earlier, later))
            apart = abs(first - second)
            if first and second and 0 < apart < automaton.period:
                if guards.exclude(earlier, later):
                    continue
                times = [f"{float(time) * 1e3:g} ms" for time in (second, first, automaton.period)]
                label = f"{times[0]} are nearer to the {times[1]} of `{earlier.name}` "
                label += f"than a period of {times[2]}"
                hint = "which of them elapses first may differ between simulation and target"
                assert later.wait
                problems.warning("near", _place(later, later.wait), label, hint)


def check_stuck(automaton: Automaton, silent: set[str], problems: Problems) -> None:
    """Warn of modes that only transitions which never fire leave; those of superstates count."""
    superstates = {mode.key for mode in automaton.superstates}
    for mode in automaton.all_modes:
        ways = [way for each in _around(automaton, mode) for way in each.transitions]
        if mode.key not in superstates and ways and all(way.key in silent for way in ways):
            label = f"mode `{mode.name}` cannot be left: none of its transitions ever fires"
            problems.warning("stuck", mode.span, label)


def _around(automaton: Automaton, mode: Mode) -> Iterator[Mode]:
    """Yield a mode and those that it stands in."""
    yield mode
    chart = automaton.tree
    own = next(node for node in chart.nodes if node.mode == mode.key) if chart else None
    for node in chart.outer(own) if chart and own else ():
        if node.mode != mode.key and node.mode in automaton.by_key:
            yield automaton.by_key[node.mode]


class _Guards:
    """The guards of one mode at one moment."""

    def __init__(self, automaton: Automaton, mode: Mode, inquiry: Inquiry) -> None:
        self.automaton = automaton
        self.mode = mode
        self.inquiry = inquiry
        self.moment = Moment(automaton, mode)
        self.known: dict[str, Expr | None] = {}
        self.waits: dict[str, Fraction] = {}
        for transition in mode.transitions:
            self.of(transition)

    def of(self, transition: Transition) -> Expr | None:
        """Return a guard, None if it has no form that questions can be asked of."""
        if transition.key not in self.known:
            self.known[transition.key] = None
            with suppress(KeyError, SpecError):
                self.known[transition.key] = self._guard(transition)
        return self.known[transition.key]

    def held(self, transition: Transition) -> Fraction:
        """Return how long a guard has to hold: whole ticks of a sampled automaton, else [s].

        At most, where that is tunable.
        """
        if transition.key not in self.waits:
            self.waits[transition.key] = _longest(self.automaton, transition)
        return self.waits[transition.key]

    def _guard(self, transition: Transition) -> Expr | None:
        source = self.automaton.source(transition)
        if source.key == self.mode.key:
            return self.moment.guard(transition)
        if not means_the_same(transition):
            return None
        return self.moment.seen_by(source).guard(transition)

    def together_never(self, *conditions: Expr | None) -> bool:
        """Tell whether conditions never hold together, whatever the tunables are."""
        found = [condition for condition in conditions if condition is not None]
        if len(found) < len(conditions):
            return False
        return self.inquiry.never(self.inquiry.question(self.moment.story, found))

    def is_first_inside(self, transition: Transition, problems: Problems) -> bool:
        """Warn of a superstate's transition before which one inside always fires."""
        found = list(inside_first(self.automaton, self.mode))
        held = self.held(transition)
        for leaf, ways in found:
            inside = _Guards(self.automaton, leaf, self.inquiry)
            first = [way for way in ways if not self.held(way)]
            first = [way for way in first if comes_along(self.automaton, way, transition)]
            others = [_not(guard) for guard in map(inside.of, first) if guard is not None]
            if not others or not inside.together_never(inside.of(transition), *others):
                return False
        what = "one of the transitions inside, which win by `order`, fires"
        return bool(found) and _report_shadow(transition, what, bool(held), problems, BY_ORDER)

    def is_silent(self, transition: Transition) -> bool:
        """Tell whether a guard never holds where none does that comes first.

        Where that is not so it is neither dead nor shadowed: one question for most transitions.
        """
        held = self.held(transition)
        others = (_not(self.of(way)) for way in self._first(transition))
        return self.together_never(self.of(transition), *self._lasted(held), *others)

    def never(self, transition: Transition) -> bool:
        """Tell whether a guard never holds."""
        return self.together_never(self.of(transition))

    def exclude(self, first: Transition, second: Transition) -> bool:
        """Tell whether two guards never hold together."""
        return self.together_never(self.of(first), self.of(second))

    def report_shadow(self, transition: Transition, problems: Problems) -> bool:
        """Warn of a transition before which others always fire; tell whether it was so."""
        guard = self.of(transition)
        if guard is None:
            return False
        before = {way.key for way in winners(self.automaton, self.mode, transition)}
        wait = _shortest(self.automaton, transition)
        first = self._first(transition)
        at_once = [way for way in first if way.key in before and not self.held(way)]
        lasted = self._lasted(wait)
        for way in first:
            own = self._lasted(wait - self.held(way)) if way.key in before else ()
            if self.together_never(guard, *own, _not(self.of(way))):
                what, hint = f"`{way.name}` fires", BY_PRIORITY
                if way.source != transition.source:
                    what, hint = (
                        f"`{way.name}` of `{way.source}`, which is around it, fires",
                        BY_ORDER,
                    )
                return _report_shadow(transition, what, bool(wait), problems, hint)
        others = [_not(self.of(way)) for way in at_once]
        if len(others) > 1 and self.together_never(guard, *lasted, *others):
            names = ", ".join(f"`{way.name}`" for way in at_once)
            what = f"one of {names} fires"
            return _report_shadow(transition, what, bool(wait), problems, BY_PRIORITY)
        return False

    def _first(self, transition: Transition) -> list[Transition]:
        """Return the transitions that fire first wherever both guards hold from one time on."""
        wait = _shortest(self.automaton, transition)
        before = {way.key: way for way in winners(self.automaton, self.mode, transition)}
        own = self.mode.transitions
        along = {way.key: way for way in own if comes_along(self.automaton, way, transition)}
        ways = {**along, **before}.values()
        return [way for way in ways if self.of(way) is not None and self._wins(way, before, wait)]

    def _wins(self, way: Transition, before: Mapping[str, Transition], wait: Fraction) -> bool:
        own = self.held(way)
        if not wait:
            return not own and way.key in before
        leaves = bool(way.targets) and not way.internal
        return (leaves and own < wait) or (own == wait and way.key in before)

    def _lasted(self, wait: Fraction) -> tuple[Expr, ...]:
        """Return that the mode has been active for a wait, where its age matters."""
        if not wait or ELAPSED not in self.moment.story.extents:
            return ()
        is_sampled = self.automaton.is_sampled
        limit = whole(int(wait)) if is_sampled else real(wait)
        return (Compare(">=", Ref(ELAPSED, is_sampled), limit),)


def _report_shadow(
    transition: Transition, what: str, waits: bool, problems: Problems, hint: str
) -> bool:
    other = f"write `{STAY}`" if transition.in_cell else "remove it"
    if waits:
        label = f"this wait never elapses: {what} before, whenever the guard holds"
        assert transition.wait
        place = _place(transition, transition.wait)
        problems.warning("timer", place, label, f"wait for less, or {other}")
    else:
        label = f"this never fires: {what} first, whenever {_guard(transition)} holds"
        problems.warning("shadowed", _place(transition, transition.when), label, hint + other)
    return True


def _place(transition: Transition, formula: Formula) -> Span:
    """Return where a formula stands; of a transition table its cell: other rows share it."""
    return transition.span if transition.in_cell else formula.span


def _guard(transition: Transition) -> str:
    return f"the guard of `{transition.name}`" if transition.in_cell else "this"


def _wait(automaton: Automaton, transition: Transition) -> Fraction:
    """Return how long a guard has to hold [s]."""
    return exact_value(transition.wait, automaton) if transition.wait else Fraction(0)


def _shortest(automaton: Automaton, transition: Transition) -> Fraction:
    """Return how long a guard has to hold at least: ticks of a sampled automaton, else [s]."""
    return _held(automaton, transition)[0]


def _longest(automaton: Automaton, transition: Transition) -> Fraction:
    """Return the same at most: it differs where the wait is tunable."""
    return _held(automaton, transition)[1]


def _held(automaton: Automaton, transition: Transition) -> Range:
    tunable = tunable_wait(automaton, transition.wait)
    if tunable:
        return range_in_ticks(automaton, automaton.parameters[tunable])
    wait = _wait(automaton, transition)
    held = Fraction(ticks_of(automaton, wait)) if automaton.period else wait
    return held, held


def _pairs(mode: Mode) -> Iterator[tuple[Transition, Transition]]:
    """Yield each two transitions of a mode that wait."""
    waiting = [way for way in mode.transitions if way.wait]
    for position, later in enumerate(waiting):
        for earlier in waiting[:position]:
            yield earlier, later


def _not(condition: Expr | None) -> Expr | None:
    if isinstance(condition, Value):
        return Value(not condition.value)
    return None if condition is None else Unary("not", condition)
