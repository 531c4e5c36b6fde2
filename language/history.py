"""History of a continuous automaton: `delay` as operations, `after` as time events.

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
    Compare,
    Expr,
    Item,
    Loop,
    Op,
    Ref,
    Select,
    Store,
    add,
    divide,
    multiply,
    real,
    subtract,
    whole,
)
from language.program import Alarm, Variable
from language.syntax import Application, memory_key, walk

AGE = Ref("memory.age")
"""Time since the last record [s]; an engine sets it."""


@dataclass(frozen=True)
class History:
    """One delayed quantity: `steps` is its delay in major steps."""

    number: int
    tree: Application
    steps: Fraction

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
        time = exact_value(Formula(tree.arguments[1], ""), automaton)
        found.append(History(len(found) + 1, tree, time / automaton.step))
    return tuple(found)


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
        older = _between(middle, far, subtract(back, real(Fraction(count - 1))))
        if history.steps == count:
            found[memory_key(history.tree)] = older
            continue
        newer = _between(near, middle, subtract(back, real(Fraction(count - 2))))
        is_older = Compare(">=", back, real(Fraction(count - 1)))
        found[memory_key(history.tree)] = Select(is_older, older, newer)
    return found


def record_block(histories: tuple[History, ...], known: Names) -> Block:
    """Return what a major step keeps: all read the values of before it."""
    ops: list[Op] = []
    commit: list[Op] = []
    for history in histories:
        kept, newest = Ref(f"work.keep_{history.number}"), Ref(history.name("newest"))
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
    newest = Ref(history.name("newest"))
    parts = ("far", "middle") if history.steps == history.whole_steps else ("far", "middle", "near")
    return [
        Assign(history.name(part), Item(history.name("values"), _place(history, newest, ahead)))
        for ahead, part in enumerate(parts, start=1)
    ]


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
    return found


def alarms_of(automaton: Automaton) -> tuple[Alarm, ...]:
    """Return the times after which an `after` in a guard is true, by mode."""
    found: list[Alarm] = []
    for mode in automaton.all_modes:
        for tree in _afters(mode).values():
            time = exact_value(Formula(tree.arguments[0], ""), automaton)
            name = f"memory.after_{len(found) + 1}"
            found.append(Alarm(name, mode.region, mode.number, time))
    return tuple(found)


def alarm_names(automaton: Automaton) -> Mapping[str, Names]:
    """Return, by the key of a mode, what the `after` in its guards are."""
    alarms = iter(alarms_of(automaton))
    return {
        mode.key: {key: Ref(next(alarms).variable) for key in _afters(mode)}
        for mode in automaton.all_modes
    }


def _afters(mode: Mode) -> dict[str, Application]:
    parts = [part for t in mode.transitions for part in walk(t.when.tree)]
    found = [part for part in parts if isinstance(part, Application) and part.function == "after"]
    return {memory_key(part): part for part in found}
