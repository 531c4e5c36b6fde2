"""Check of transitions: what never fires - dead, shadowed, a wait that never elapses - and waits
that are nearer to each other than a period. Warnings: nothing of it is ambiguous.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from fractions import Fraction

from language.constants import exact_value
from language.inquiry import Inquiry
from language.model import Automaton, Mode, Transition
from language.moment import ELAPSED, Moment
from language.operation import Compare, Expr, Ref, Unary, Value, real, whole
from language.problem import Problems, SpecError
from language.region import by_priority


def check_transitions(automaton: Automaton, inquiry: Inquiry, problems: Problems) -> set[str]:
    """Warn of transitions that never fire; return the keys of them."""
    silent: set[str] = set()
    for mode in automaton.all_modes:
        guards = _Guards(automaton, mode, inquiry)
        for position, (_, transition) in enumerate(by_priority(mode)):
            if not guards.is_silent(transition, position):
                continue
            if guards.never(transition):
                label = "this never holds within the declared ranges"
                hint = "they exclude it, with the equations of the mode: correct one of them"
                problems.warning("dead", transition.when.span, label, hint)
            elif not guards.report_shadow(transition, position, problems):
                continue
            silent.add(transition.key)
    return silent


def check_waits(automaton: Automaton, inquiry: Inquiry, problems: Problems) -> None:
    """Warn of two waits that differ by less than a period (rule 10)."""
    if automaton.period is None:
        return
    for mode in automaton.all_modes:
        guards = _Guards(automaton, mode, inquiry)
        for earlier, later in _pairs(mode):
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
                problems.warning("near", later.wait.span, label, hint)


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
        for transition in mode.transitions:
            self.of(transition)

    def of(self, transition: Transition) -> Expr | None:
        """Return a guard, None if it has no form that questions can be asked of."""
        if transition.key not in self.known:
            self.known[transition.key] = None
            if transition.events or transition.completes:
                return None
            with suppress(KeyError, SpecError):
                self.known[transition.key] = self.moment.expression(transition.when.tree)
        return self.known[transition.key]

    def together_never(self, *conditions: Expr | None) -> bool:
        """Tell whether conditions never hold together, whatever the tunables are."""
        found = [condition for condition in conditions if condition is not None]
        if len(found) < len(conditions):
            return False
        return self.inquiry.never(self.inquiry.question(self.moment.story, found))

    def is_silent(self, transition: Transition, position: int) -> bool:
        """Tell whether a guard never holds where none does that comes first.

        Where that is not so it is neither dead nor shadowed: one question for most transitions.
        """
        before = [way for _, way in by_priority(self.mode)[:position]]
        held = _held(self.automaton, transition)
        first = [way for way in self.mode.transitions if self._comes_first(way, before, held)]
        others = (_not(self.of(way)) for way in first)
        return self.together_never(self.of(transition), *self._lasted(held), *others)

    def never(self, transition: Transition) -> bool:
        """Tell whether a guard never holds."""
        return self.together_never(self.of(transition))

    def exclude(self, first: Transition, second: Transition) -> bool:
        """Tell whether two guards never hold together."""
        return self.together_never(self.of(first), self.of(second))

    def report_shadow(self, transition: Transition, position: int, problems: Problems) -> bool:
        """Warn of a transition before which others always fire; tell whether it was so."""
        guard = self.of(transition)
        if guard is None:
            return False
        before = [way for _, way in by_priority(self.mode)[:position]]
        wait = _held(self.automaton, transition)
        at_once = [way for way in before if not _held(self.automaton, way)]
        single = [way for way in self.mode.transitions if self._comes_first(way, before, wait)]
        lasted = self._lasted(wait)
        for way in single:
            own = lasted if way in before else ()
            if self.together_never(guard, *own, _not(self.of(way))):
                return _report_shadow(transition, f"`{way.name}` fires", bool(wait), problems)
        others = [_not(self.of(way)) for way in at_once]
        if len(others) > 1 and self.together_never(guard, *lasted, *others):
            names = ", ".join(f"`{way.name}`" for way in at_once)
            return _report_shadow(transition, f"one of {names} fires", bool(wait), problems)
        return False

    def _comes_first(self, way: Transition, before: list[Transition], wait: Fraction) -> bool:
        """Tell whether a transition fires first wherever both guards hold from one time on."""
        own = _held(self.automaton, way)
        leaves = not way.internal
        return (leaves and own < wait) or (own == wait and way in before)

    def _lasted(self, wait: Fraction) -> tuple[Expr, ...]:
        """Return that the mode has been active for a wait, where its age matters."""
        if not wait or ELAPSED not in self.moment.story.extents:
            return ()
        is_sampled = self.automaton.is_sampled
        limit = whole(int(wait)) if is_sampled else real(wait)
        return (Compare(">=", Ref(ELAPSED, is_sampled), limit),)


def _report_shadow(transition: Transition, what: str, waits: bool, problems: Problems) -> bool:
    if waits:
        label = f"this wait never elapses: {what} before, whenever the guard holds"
        assert transition.wait
        problems.warning("timer", transition.wait.span, label, "wait for less, or remove it")
    else:
        label = f"this never fires: {what} first, whenever this holds"
        hint = "give it a smaller priority, or remove it"
        problems.warning("shadowed", transition.when.span, label, hint)
    return True


def _wait(automaton: Automaton, transition: Transition) -> Fraction:
    """Return how long a guard has to hold [s]."""
    return exact_value(transition.wait, automaton) if transition.wait else Fraction(0)


def _held(automaton: Automaton, transition: Transition) -> Fraction:
    """Return how long a guard has to hold: whole ticks of a sampled automaton, else [s]."""
    wait = _wait(automaton, transition)
    return Fraction(math.ceil(wait / automaton.period)) if automaton.period else wait


def _pairs(mode: Mode) -> Iterator[tuple[Transition, Transition]]:
    for position, later in enumerate(mode.transitions):
        for earlier in mode.transitions[:position]:
            yield earlier, later


def _not(condition: Expr | None) -> Expr | None:
    if isinstance(condition, Value):
        return Value(not condition.value)
    return None if condition is None else Unary("not", condition)
