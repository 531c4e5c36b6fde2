"""Memory of a sampled automaton: `previous` and `delay` as operations.

A delay of N ticks is a ring of N values; the oldest is overwritten once a tick, when the equations
of the resulting mode hold and before the updates. Until it was written once, a delayed value is
the value of now. What guards remember of an activation is in language/activation.py.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from language.constants import exact_value
from language.declaration import Formula
from language.dimension import DimensionCheck
from language.kind import Enumeration, Whole
from language.lower import Names, expression
from language.model import Automaton, Mode
from language.once import once
from language.operation import (
    Assign,
    Block,
    Branch,
    Compare,
    Expr,
    Item,
    Loop,
    Op,
    Ref,
    Select,
    Store,
    Value,
    add,
    whole,
)
from language.problem import Problems
from language.program import ValueType, Variable
from language.scope import Scope
from language.syntax import (
    KEPT,
    MEMORY,
    Application,
    Tree,
    memory_key,
    walk,
)
from language.truth import decisions

MAX_DELAY = 4096
"""Longest delay in values kept: 32 kB of an instance."""
MAX_REWIND = 64
"""Longest rewind in ticks kept."""
KEPT_ONCE = Ref("memory.kept")


@dataclass(frozen=True)
class Delay:
    """A value as it was some ticks ago (`ticks` 1: `previous`)."""

    number: int
    tree: Application
    ticks: int
    type: ValueType

    @property
    def name(self) -> str:
        """The variable that holds the values: a scalar where there is one, else a ring."""
        return f"memory.delay_{self.number}"

    @property
    def oldest(self) -> str:
        """The variable that says which value of the ring is the oldest."""
        return f"memory.oldest_{self.number}"


def formulas(mode: Mode) -> Iterator[Formula]:
    """Yield the equations, updates, entries, exits, noises, guards and resets of a mode."""
    yield from mode.equations.values()
    yield from actions(mode)


def actions(mode: Mode) -> Iterator[Formula]:
    """Yield the formulas of a mode that are no equations."""
    for stage in (mode.update, mode.entry, mode.exit):
        yield from stage.values()
    if mode.observer:
        yield from mode.observer.process_noise.values()
    for transition in mode.transitions:
        yield transition.when
        yield from transition.reset.values()
        if transition.rewind:
            yield transition.rewind.until


def applications(automaton: Automaton, functions: tuple[str, ...]) -> dict[str, Application]:
    """Return each different use of some functions, by key; what is inside comes first."""
    found: dict[str, Application] = {}
    for part in remembering(automaton):
        if part.function in functions:
            found.setdefault(memory_key(part), part)
    return found


@once
def remembering(automaton: Automaton) -> tuple[Application, ...]:
    """Return every use of a function with memory; what is inside of one comes before it."""
    found: list[Application] = []
    for tree in _trees(automaton):
        found += reversed(
            [p for p in walk(tree) if isinstance(p, Application) and p.function in MEMORY]
        )
    return tuple(found)


def applies(automaton: Automaton, function: str) -> bool:
    """Tell whether a function is used anywhere, with memory or without."""
    parts = (part for tree in _trees(automaton) for part in walk(tree))
    return any(isinstance(part, Application) and part.function == function for part in parts)


def _trees(automaton: Automaton) -> list[Tree]:
    """Return every expression that is evaluated in a mode or in a decision."""
    trees = [formula.tree for formula in decisions(automaton.tables)]
    for mode in automaton.all_modes:
        trees += [formula.tree for formula in formulas(mode)]
        trees += [balance.right for balance in mode.flow.values()]
    return trees


def ticks_of(automaton: Automaton, time: Tree) -> int:
    """Return a time of fixed values in ticks, rounded up, exactly (rule 4). Raises SpecError."""
    assert automaton.period is not None
    return math.ceil(exact_value(Formula(time, ""), automaton) / automaton.period)


def delays_of(automaton: Automaton) -> tuple[Delay, ...]:
    """Return what a sampled automaton remembers of its values."""
    found: list[Delay] = []
    for tree in applications(automaton, KEPT).values():
        ticks = ticks_of(automaton, tree.arguments[1]) if tree.function == "delay" else 1
        kind = type_of(automaton, tree.arguments[0])
        found.append(Delay(len(found) + 1, tree, ticks, kind))
    return tuple(found)


def type_of(automaton: Automaton, tree: Tree) -> ValueType:
    """Return the type of a checked expression: as the check of dimensions sees it."""
    scope = Scope(automaton.kinds, memory=frozenset(MEMORY))
    kind = DimensionCheck(scope, Problems()).kind(tree)
    if kind == "truth":
        return "truth"
    return "whole" if isinstance(kind, Whole | Enumeration) else "real"


def with_delays(delays: tuple[Delay, ...], known: Names) -> dict[str, Expr]:
    """Return what names are, and what each delayed value is."""
    found = dict(known)
    for delay in delays:
        now = expression(delay.tree.arguments[0], found)
        whole = delay.type == "whole"
        old: Expr = Ref(delay.name, whole)
        if delay.ticks > 1:
            old = Item(delay.name, Ref(delay.oldest), whole)
        key = memory_key(delay.tree)
        found[key] = Select(KEPT_ONCE, old, now) if delay.ticks else now
    return found


def keep_block(automaton: Automaton, delays: tuple[Delay, ...], known: Names) -> Block:
    """Return what a tick keeps, once its equations hold: all read the values of before it."""
    values: list[Op] = []
    fill: list[Op] = []
    replace: list[Op] = []
    commit: list[Op] = []
    for delay in delays:
        kept = Ref(f"work.keep_{delay.number}")
        if delay.ticks:
            values.append(Assign(kept.name, expression(delay.tree.arguments[0], known)))
        if delay.ticks == 1:
            commit.append(Assign(delay.name, kept))
        if delay.ticks > 1:
            slot, oldest = Ref("work.slot"), Ref(delay.oldest)
            fill.append(Loop(delay.ticks, slot.name, (Store(delay.name, slot, kept),)))
            last = Compare("==", oldest, whole(delay.ticks - 1))
            replace.append(Store(delay.name, oldest, kept))
            replace.append(Assign(oldest.name, Select(last, whole(0), add(oldest, whole(1)))))
    ring: Block = (Branch(KEPT_ONCE, tuple(replace), tuple(fill)),) if fill else ()
    done: Block = (Assign(KEPT_ONCE.name, Value(True)),) if values else ()
    return (*values, *ring, *commit, *done)


def memory_variables(automaton: Automaton, delays: tuple[Delay, ...]) -> list[Variable]:
    """Return the variables of delays; `finished` leaves out what is not used."""
    found = [
        Variable("memory.kept", "truth", about="delayed values are kept"),
        Variable("work.slot", "whole"),
    ]
    for delay in delays:
        size = delay.ticks if delay.ticks > 1 else 0
        found.append(Variable(delay.name, delay.type, size=size, about=_about(delay)))
        found.append(Variable(delay.oldest, "whole", about="which of them is the oldest"))
        found.append(Variable(f"work.keep_{delay.number}", delay.type))
    return found


def _about(delay: Delay) -> str:
    return "value of the tick before" if delay.ticks == 1 else f"values of {delay.ticks} ticks"
