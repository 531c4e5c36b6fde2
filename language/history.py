"""History of a continuous automaton: `delay` as operations, `after` and `every` as time events.

A delayed quantity is kept at the major steps, when everything of that instant has happened, and
read by linear interpolation: a step of it becomes a ramp over one major step. What is read lies at
least one major step back, so a step of the integration never needs what it computes, and nothing is
kept while states flow (rule 1). Between two records only the three oldest values are read.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from language.constants import exact_value
from language.declaration import Formula
from language.lower import Names, expression
from language.memory import applications
from language.model import Automaton, Mode
from language.operation import (
    Assign,
    Block,
    Call,
    Compare,
    Expr,
    Item,
    Loop,
    Op,
    Ref,
    Select,
    Store,
    Unary,
    add,
    divide,
    multiply,
    real,
    subtract,
    whole,
)
from language.parameter import constant_names
from language.program import Alarm, Variable
from language.syntax import TIMES, Application, Name, Tree, memory_key, walk

AGE = Ref("memory.age")
"""Time since the last record [s]; an engine sets it."""


@dataclass(frozen=True)
class History:
    """One delayed quantity: `steps` is its delay in major steps, the longest if it is `tunable`.

    `tunable` is the parameter [s] that the delay is, at least one major step.
    """

    number: int
    tree: Application
    steps: Fraction
    step: Fraction
    tunable: Expr | None = None

    @property
    def whole_steps(self) -> int:
        """The delay in major steps, rounded up."""
        return math.ceil(self.steps)

    def name(self, part: str) -> str:
        """Return the variable of a part: `values`, `newest`, `far`, `middle`, `near`."""
        return f"memory.{part}_{self.number}"


def histories_of(automaton: Automaton) -> tuple[History, ...]:
    """Return what a continuous automaton delays, what is inside another delay first."""
    found: list[History] = []
    for tree in applications(automaton, ("delay",)).values():
        time, step = tree.arguments[1], automaton.step
        tuned = tunable_time(automaton, time)
        if tuned is None:
            steps = exact_value(Formula(time, ""), automaton) / step
            found.append(History(len(found) + 1, tree, steps, step))
        else:
            steps = Fraction(max(1, math.ceil(tuned[1] / step)))
            parameter = constant_names(automaton)[tuned[0]]
            found.append(History(len(found) + 1, tree, steps, step, parameter))
    return tuple(found)


def tunable_time(automaton: Automaton, time: Tree) -> tuple[str, Fraction] | None:
    """Return the parameter that a time is if it is tunable, and the end of its range [s]."""
    if isinstance(time, Name):
        parameter = automaton.parameters.get(time.path)
        if parameter and parameter.kind == "tunable" and parameter.range:
            return parameter.name, parameter.range[1]
    return None


def delayed(automaton: Automaton, histories: tuple[History, ...]) -> dict[str, Expr]:
    """Return what each delayed quantity is at `work.s` after the start of a step.

    Counted in major steps back from the last record it is at q - (age + s) / step, q being the
    delay: between the values N and N - 1 back, N = ceil(q), or between those N - 1 and N - 2 back.
    """
    found: dict[str, Expr] = {}
    for history in histories:
        passed = divide(add(AGE, Ref("work.s")), real(automaton.step))
        back = subtract(real(history.steps), passed)
        count = history.whole_steps
        far, middle, near = (Ref(history.name(part)) for part in ("far", "middle", "near"))
        if history.tunable is not None:
            found[memory_key(history.tree)] = _tuned(history, passed)
            continue
        older = _between(middle, far, subtract(back, real(Fraction(count - 1))))
        if history.steps == count:
            found[memory_key(history.tree)] = older
            continue
        newer = _between(near, middle, subtract(back, real(Fraction(count - 2))))
        is_older = Compare(">=", back, real(Fraction(count - 1)))
        found[memory_key(history.tree)] = Select(is_older, older, newer)
    return found


def _tuned(history: History, passed: Expr) -> Expr:
    """What a delay of a tunable length is, `passed` major steps after the last record."""
    far, middle, near = (Ref(history.name(part)) for part in ("far", "middle", "near"))
    last = subtract(Call("real", (Ref(history.name("count"), whole=True),)), real(1.0))
    over = subtract(subtract(Ref(history.name("delay")), passed), last)
    newer = _between(near, middle, add(over, real(1.0)))
    return Select(Compare(">=", over, real(0.0)), _between(middle, far, over), newer)


def record_block(histories: tuple[History, ...], known: Names) -> Block:
    """Return what a major step keeps: all read the values of before it."""
    ops: list[Op] = []
    commit: list[Op] = []
    for history in histories:
        kept = Ref(f"work.keep_{history.number}")
        newest = Ref(history.name("newest"), whole=True)
        ops.append(Assign(kept.name, expression(history.tree.arguments[0], known)))
        commit.append(Assign(newest.name, _place(history, newest, 1)))
        commit.append(Store(history.name("values"), newest, kept))
        commit += _oldest(history)
    return (*ops, *commit)


def fill_block(histories: tuple[History, ...], known: Names) -> Block:
    """Return what fills each history with the value at the start."""
    ops: list[Op] = []
    for history in histories:
        kept, slot = Ref(f"work.keep_{history.number}"), Ref("work.slot")
        ops.append(Assign(kept.name, expression(history.tree.arguments[0], known)))
        store = Store(history.name("values"), slot, kept)
        ops.append(Loop(history.whole_steps + 1, slot.name, (store,)))
        ops.append(Assign(history.name("newest"), whole(0)))
        ops += _oldest(history)
    return tuple(ops)


def _between(newer: Ref, older: Ref, part: Expr) -> Expr:
    return add(newer, multiply(part, subtract(older, newer)))


def _place(history: History, newest: Ref, ahead: int) -> Expr:
    """The place in the ring that comes `ahead` places after the newest value."""
    size = history.whole_steps + 1
    last = Compare(">=", newest, whole(size - ahead))
    return Select(last, subtract(newest, whole(size - ahead)), add(newest, whole(ahead)))


def _oldest(history: History) -> list[Op]:
    newest = Ref(history.name("newest"), whole=True)
    if history.tunable is not None:
        return _oldest_tuned(history, newest)
    parts = ("far", "middle") if history.steps == history.whole_steps else ("far", "middle", "near")
    return [
        Assign(history.name(part), Item(history.name("values"), _place(history, newest, ahead)))
        for ahead, part in enumerate(parts, start=1)
    ]


def _oldest_tuned(history: History, newest: Ref) -> list[Op]:
    """The delay as it is now, and the values around its end."""
    delay, count = history.name("delay"), history.name("count")
    assert history.tunable is not None
    steps = divide(history.tunable, real(history.step))
    size = history.whole_steps + 1
    rounded_up = Unary("-", Call("floor", (Unary("-", Ref(delay)),)))
    ops: list[Op] = [
        Assign(delay, Call("clip", (steps, real(1.0), real(history.steps)))),
        Assign(count, Call("whole", (rounded_up,))),
    ]
    for less, part in enumerate(("far", "middle", "near")):
        place = add(subtract(newest, Ref(count, whole=True)), whole(less))
        inside = Select(Compare("<", place, whole(0)), add(place, whole(size)), place)
        if part == "near":
            inside = Select(Compare(">", Ref(count, whole=True), whole(1)), inside, newest)
        ops.append(Assign(history.name(part), Item(history.name("values"), inside)))
    return ops


def history_variables(histories: tuple[History, ...]) -> list[Variable]:
    """Return the variables of histories; `finished` leaves out what is not used."""
    found = [
        Variable(AGE.name, "real", "s", about="time since the last record"),
        Variable("work.slot", "whole"),
        Variable("work.round", "whole"),
    ]
    for history in histories:
        size = history.whole_steps + 1
        found.append(Variable(history.name("values"), "real", size=size, about="a major step each"))
        found.append(Variable(history.name("newest"), "whole", about="which is the newest"))
        found += [Variable(history.name(part), "real") for part in ("far", "middle", "near")]
        found.append(Variable(f"work.keep_{history.number}", "real"))
        found.append(Variable(history.name("delay"), "real", about="delay in major steps"))
        found.append(Variable(history.name("count"), "whole", about="delay, rounded up"))
    return found


def alarms_of(automaton: Automaton) -> tuple[Alarm, ...]:
    """Return the times after which an `after` or `every` in a guard is true, by mode."""
    found: list[Alarm] = []
    for mode in automaton.all_modes:
        for tree in _times(mode).values():
            time = exact_value(Formula(tree.arguments[0], ""), automaton)
            name = f"memory.{tree.function}_{len(found) + 1}"
            repeats = tree.function == "every"
            found.append(Alarm(name, mode.region, mode.number, time, repeats))
    return tuple(found)


def alarm_names(automaton: Automaton) -> Mapping[str, Names]:
    """Return, by the key of a mode, what the times in its guards are."""
    alarms = iter(alarms_of(automaton))
    return {
        mode.key: {key: Ref(next(alarms).variable) for key in _times(mode)}
        for mode in automaton.all_modes
    }


def _times(mode: Mode) -> dict[str, Application]:
    parts = [part for t in mode.transitions for part in walk(t.when.tree)]
    found = [part for part in parts if isinstance(part, Application) and part.function in TIMES]
    return {memory_key(part): part for part in found}
