"""Check of cycles: transitions that go round for ever at one instant (rules 7, 9 and 12).

A way round is reported where it is taken twice from some values and, from these, as often as the
bound of micro-steps is passed: then a run stops there, for certain.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import islice

from language.constants import exact_value
from language.graph import components
from language.halfspace import disproved
from language.inquiry import Inquiry, Witness
from language.model import Automaton, Mode, Transition
from language.moment import Moment, Story
from language.once import once
from language.operation import Expr, Unary
from language.problem import Problems, SpecError
from language.syntax import Name, Relation, Tree, walk

LONGEST = 4
"""Transitions of a way round that is looked for; longer ones are made of more than one mistake."""
MOST_WAYS_ROUND = 200
"""Ways round of one automaton that are looked at."""

Way = tuple[Transition, ...]


def report_refiring(automaton: Automaton, problems: Problems) -> None:
    """Report transitions to a mode and back that fire for ever at one instant, with a witness."""
    for way, witness in _forever(automaton, range(1, 3)):
        label = f"this fires again at the same instant, for ever: {_path(way)}"
        hint = f"{witness.place}write the direction of motion too, like "
        hint += "`x >= limit and v > 0 m/s`" + _open_ended(automaton)
        problems.error("refire", _bare(automaton, way).when.span, label, hint)


def check_cycles(automaton: Automaton, problems: Problems) -> None:
    """Warn of longer ways round that are taken for ever at one instant: a run stops there."""
    for way, witness in _forever(automaton, range(3, LONGEST + 1)):
        label = f"from here the modes change for ever at one instant: {_path(way)}"
        hint = f"{witness.place}let one of them wait, or its guard exclude the one before"
        hint += _open_ended(automaton)
        problems.warning("cycle", _bare(automaton, way).when.span, label, hint)


def _forever(automaton: Automaton, lengths: range) -> Iterator[tuple[Way, Witness]]:
    """Yield ways round of some lengths that are taken for ever, the first turn that shows it."""
    if automaton.is_sampled:
        return  # language/check_endless.py
    inquiry = Inquiry(automaton)
    for way in ways_round(automaton):
        for turn in range(len(way) if len(way) in lengths else 0):
            turned = (*way[turn:], *way[:turn])
            found = _taken_forever(automaton, turned, inquiry)
            if found:
                yield turned, found
                break


@once
def ways_round(automaton: Automaton) -> tuple[Way, ...]:
    """Return the ways round of which each transition can follow the one before at one instant."""
    inquiry = Inquiry(automaton)
    ways = {way.key: way for way in instant_ways(automaton)}
    after: dict[str, list[str]] = {key: [] for key in ways}
    for first, seconds in _possible_seconds(automaton, list(ways.values())):
        after[first.key] = [way.key for way in _not_disproved(automaton, first, seconds, inquiry)]
    follows: dict[tuple[str, str], bool] = {}
    found: list[Way] = []
    for members in islice(simple_cycles(after), MOST_WAYS_ROUND):
        way = tuple(ways[key] for key in members)
        pairs = [(first, second) for first, second in zip(way, (*way[1:], way[0]), strict=True)]
        for first, second in pairs:
            key = first.key, second.key
            if key not in follows:
                follows[key] = _follows(automaton, first, second, inquiry)
            if not follows[key]:
                break
        else:
            found.append(way)
    return tuple(found)


def instant_ways(automaton: Automaton) -> list[Transition]:
    """Return the transitions that need no time."""
    found = [way for mode in automaton.all_modes for way in mode.transitions]
    return [way for way in found if not (way.wait and exact_value(way.wait, automaton))]


def simple_cycles(after: Mapping[str, list[str]]) -> Iterator[tuple[str, ...]]:
    """Yield the cycles of at most `LONGEST` members, each once, from its first member on."""
    place = {name: number for number, name in enumerate(after)}
    for group in components(after):
        inside = set(group)
        for start in group:
            stack: list[tuple[str, ...]] = [(start,)]
            while stack:
                path = stack.pop()
                for name in after[path[-1]]:
                    if name == start:
                        yield path
                    elif name in inside and place[name] > place[start] and name not in path:
                        stack += [(*path, name)] if len(path) < LONGEST else []


def _possible_seconds(
    automaton: Automaton, ways: list[Transition]
) -> Iterator[tuple[Transition, list[Transition]]]:
    """Yield each transition with those that leave where it leads, on a way round of modes."""
    modes: dict[str, list[str]] = {f"{m.region} {m.name}": [] for m in automaton.all_modes}
    leaving: dict[str, list[Transition]] = {}
    for way in ways:
        modes[f"{way.region} {way.source}"].append(f"{way.region} {way.target}")
        leaving.setdefault(f"{way.region} {way.source}", []).append(way)
    groups = {name: number for number, group in enumerate(components(modes)) for name in group}
    for way in ways:
        target = f"{way.region} {way.target}"
        if groups[target] == groups[f"{way.region} {way.source}"]:
            seconds = [(f"{second.region} {second.target}", second) for second in leaving[target]]
            yield way, [second for name, second in seconds if groups[name] == groups[target]]


def _not_disproved(
    automaton: Automaton, first: Transition, seconds: list[Transition], inquiry: Inquiry
) -> Iterator[Transition]:
    """Yield the transitions that linear bounds let follow another one at the same instant."""
    moment = Moment(automaton, automaton.source(first))
    try:
        guard = moment.expression(first.when.tree)
        there = moment.after(first)
    except (KeyError, SpecError):
        return
    for second in seconds:
        with suppress(KeyError, SpecError):
            condition = there.expression(second.when.tree)
            if not disproved(inquiry.question(moment.story, (guard, condition))):
                yield second


def _follows(automaton: Automaton, first: Transition, second: Transition, inquiry: Inquiry) -> bool:
    """Tell whether a transition can be followed by another one at the same instant."""
    try:
        story, guards = taken(automaton, (first, second))
    except (KeyError, SpecError):
        return False
    return not inquiry.never(inquiry.question(story, guards))


def taken(automaton: Automaton, way: Way) -> tuple[Story, list[Expr]]:
    """Return the story of transitions taken one after another at an instant, and what it needs.

    Of each the guard holds, and no guard of a smaller priority that needs no time.
    """
    story = Story()
    moment = Moment(automaton, automaton.source(way[0]), story)
    needed: list[Expr] = []
    for position, transition in enumerate(way):
        for other in moment.mode.transitions:
            if (other.priority or 0) < (transition.priority or 0) and not other.wait:
                needed.append(Unary("not", moment.expression(other.when.tree)))
        needed.append(moment.expression(transition.when.tree))
        if position + 1 < len(way):
            moment = moment.after(transition)
    return story, needed


def _taken_forever(automaton: Automaton, way: Way, inquiry: Inquiry) -> Witness | None:
    """Return values from which a way round is taken past the bound of micro-steps."""
    try:
        found = inquiry.answer(inquiry.question(*taken(automaton, way * 2)))
        if not isinstance(found, Witness):
            return None
        if _is_disturbed(automaton, way, found):
            return None
        bound = len(automaton.region(way[0].region).modes)
        rounds = bound // len(way) + 2
        lasting = inquiry.question(*taken(automaton, way * rounds))
    except (KeyError, SpecError):
        return None
    return found if lasting.holds_at(found.point) else None


def _is_disturbed(automaton: Automaton, way: Way, witness: Witness) -> bool:
    """Tell whether another region may change what the guards read: it moves at the same time."""
    if any(name.startswith("mode.") for name in witness.point):
        return True
    others = (m for m in automaton.all_modes if m.region != way[0].region)
    written = {name for mode in others for name in _assigned(mode)}
    return any(name.partition(".")[2] in written for name in witness.point)


def _assigned(mode: Mode) -> Iterator[str]:
    for formulas in (mode.entry, mode.exit, *(way.reset for way in mode.transitions)):
        yield from formulas


def _path(way: Way) -> str:
    return " -> ".join(f"`{transition.source}`" for transition in (*way, way[0]))


def _open_ended(automaton: Automaton) -> str:
    """Return the help for states whose values have no bounds."""
    names = [f"`{name}`" for name, state in automaton.states.items() if state.range is None]
    return f", or give {', '.join(names)} a `range` if this is out of reach" if names else ""


def _bare(automaton: Automaton, way: Way) -> Transition:
    """Return the transition to point at: one whose guard holds on a boundary."""
    bare = (t for t in reversed(way) if _has_boundary(t.when.tree, automaton.states))
    return next(bare, way[-1])


def _has_boundary(guard: Tree, states: Mapping[str, object]) -> bool:
    """Tell whether a guard holds where a state sits exactly on a limit: `x >= limit`."""
    for part in walk(guard):
        if isinstance(part, Relation) and part.operator in ("<=", ">="):
            sides = (part.left, part.right)
            if any(isinstance(side, Name) and side.path in states for side in sides):
                return True
    return False
