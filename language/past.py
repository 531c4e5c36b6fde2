"""Past: what a sampled automaton keeps of its ticks for the transitions that go back.

Rings of the states of the model and of the inputs that are asked for, written each tick after the
jump while a mode is active that such a transition leaves; a counter says how many places belong to
this activation, so that nobody looks behind the entry.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from language.constants import exact_value
from language.lower import variable_names
from language.model import Automaton, Mode, Rewind, Transition
from language.once import once
from language.operation import (
    Assign,
    Block,
    Branch,
    Choose,
    Compare,
    Count,
    Expr,
    Item,
    Op,
    Ref,
    Select,
    Store,
    Value,
    add,
    subtract,
    whole,
)
from language.program import Variable, value_type
from language.region import closure, sources
from language.wiring import any_fired

KEPT = Ref("timer.past", whole=True)
"""How many places belong to this activation of the mode."""
NEWEST = Ref("memory.newest", whole=True)
PLACE = Ref("work.place", whole=True)


@dataclass(frozen=True)
class Rewinding:
    """A transition of an automaton that goes back."""

    automaton: Automaton
    source: Mode
    transition: Transition
    rewind: Rewind

    @property
    def ticks(self) -> int:
        """The ticks that it looks back, rounded up exactly (rule 4)."""
        assert self.automaton.period is not None
        return math.ceil(exact_value(self.rewind.within, self.automaton) / self.automaton.period)

    @property
    def flow(self) -> str | None:
        """The mode of the model whose flow leads back; None where the states stand still."""
        if self.source.run:
            return self.source.run.mode
        return self.source.observer.of if self.source.observer else None

    @property
    def label(self) -> str:
        """The ending of its blocks: names may hold `_`, so its place among those of its mode."""
        return f"{self.source.name}_{self.source.transitions.index(self.transition)}"

    @property
    def read_by_jump(self) -> list[str]:
        """The names that the exit and the reset read."""
        written = (*self.source.exit.values(), *self.transition.reset.values())
        return [name for formula in written for name in formula.reads]


@once
def rewinds_of(automaton: Automaton) -> tuple[Rewinding, ...]:
    """Return the transitions of an automaton that go back."""
    modes = automaton.modes.values()
    return tuple(rewinding for mode in modes for rewinding in rewinds_from(automaton, mode))


def rewinds_from(automaton: Automaton, mode: Mode) -> list[Rewinding]:
    """Return the transitions that leave a mode of the chart and go back."""
    return [
        Rewinding(automaton, mode, transition, transition.rewind)
        for transition in mode.transitions
        if transition.rewind
    ]


@once
def entered_late(automaton: Automaton) -> frozenset[str]:
    """Return the modes that a transition enters which goes back."""
    return frozenset(rewinding.transition.target for rewinding in rewinds_of(automaton))


def taken_back(automaton: Automaton) -> tuple[str, ...]:
    """Return the states that a rewind takes back: those of the model."""
    assert automaton.model
    return tuple(automaton.model.states)


def keep_past(automaton: Automaton) -> Block:
    """Return what a tick keeps, once it has jumped."""
    rewinds = rewinds_of(automaton)
    if not rewinds:
        return ()
    size = _size(automaton)
    keep: Block = (
        Assign(NEWEST.name, Select(_is_last(size), whole(0), add(NEWEST, whole(1)))),
        *(Store(f"memory.past_{n}", NEWEST, Ref(f"state.{n}")) for n in taken_back(automaton)),
        *(Store(f"memory.past_{n}", NEWEST, ref) for n, ref in kept_inputs(automaton).items()),
        Count(KEPT.name, Value(True), size),
    )
    numbers = dict.fromkeys(rewinding.source.number for rewinding in rewinds)
    return (
        Branch(any_fired(automaton), (Assign(KEPT.name, whole(0)),)),
        Choose("memory.mode", tuple((number, keep) for number in numbers)),
    )


@once
def kept_inputs(automaton: Automaton) -> dict[str, Ref]:
    """Return the inputs that are kept: what runs, `until`, exit, reset and entry read."""
    read: set[str] = set()
    for rewinding in rewinds_of(automaton):
        target = automaton.target(rewinding.transition)
        entered = [name for formula in target.entry.values() for name in formula.reads]
        asked = [*rewinding.rewind.until.reads, *rewinding.read_by_jump]
        read |= _all_reads(rewinding.source, asked) | _all_reads(target, entered)
        read |= {*automaton.model.inputs} if automaton.model else set()
    names = variable_names(automaton, "input")
    found = {name: names[name] for name in automaton.inputs if name in read}
    return {name: ref for name, ref in found.items() if isinstance(ref, Ref)}


def run_inputs(automaton: Automaton) -> list[str]:
    """Return the inputs that the runs of an automaton read."""
    assert automaton.model
    return [name for name in automaton.inputs if name in automaton.model.inputs]


def input_at(automaton: Automaton, name: str, group: Literal["past", "after"] = "past") -> Ref:
    """Return an input at the point that is looked at, or at the tick after it."""
    return Ref(f"work.{group}_{name}", kept_inputs(automaton)[name].whole)


def find_place(automaton: Automaton, back: Expr) -> Block:
    """Return what finds the place of the tick so many places before the newest one."""
    around = Assign(PLACE.name, add(PLACE, whole(_size(automaton))))
    find = Assign(PLACE.name, subtract(NEWEST, back))
    return (find, Branch(Compare("<", PLACE, whole(0)), (around,)))


def states_at_place(automaton: Automaton, group: Literal["at", "after"]) -> list[Op]:
    """Return what takes the states from a place of the rings."""
    return [
        Assign(f"work.{group}_{name}", Item(f"memory.past_{name}", PLACE))
        for name in taken_back(automaton)
    ]


def states_as_now(automaton: Automaton, group: Literal["at", "after"]) -> list[Op]:
    """Return what takes the states as they are now."""
    names = taken_back(automaton)
    return [Assign(f"work.{group}_{name}", Ref(f"state.{name}")) for name in names]


def inputs_at_place(automaton: Automaton, group: Literal["past", "after"]) -> list[Op]:
    """Return what takes the inputs from a place of the rings."""
    return [
        Assign(input_at(automaton, name, group).name, Item(f"memory.past_{name}", PLACE, ref.whole))
        for name, ref in kept_inputs(automaton).items()
    ]


def inputs_as_now(automaton: Automaton, group: Literal["past", "after"]) -> list[Op]:
    """Return what takes the inputs as they are now."""
    kept = kept_inputs(automaton).items()
    return [Assign(input_at(automaton, name, group).name, ref) for name, ref in kept]


def run_inputs_at_place(automaton: Automaton) -> list[Op]:
    """Return what puts the inputs of a place of the rings where runs read those of before."""
    kept = kept_inputs(automaton)
    items = {n: Item(f"memory.past_{n}", PLACE, kept[n].whole) for n in run_inputs(automaton)}
    return [Assign(f"before.{name}", item) for name, item in items.items()]


def past_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables of what is kept, and of the points that are taken from it."""
    if not rewinds_of(automaton):
        return []
    size = _size(automaton)
    about = f"of {size} ticks" if size > 1 else "of the tick before"
    found = [
        Variable(KEPT.name, "whole", about=f"ticks kept of this activation, at most {size}"),
        Variable(NEWEST.name, "whole", about="which of the kept ticks is the newest"),
        Variable(PLACE.name, "whole"),
    ]
    for name in taken_back(automaton):
        unit = str(automaton.states[name].unit.dimension)
        found.append(Variable(f"memory.past_{name}", "real", unit, size, about))
        found.append(Variable(f"work.after_{name}", "real", unit))
    for name in kept_inputs(automaton):
        thing = automaton.inputs[name]
        unit, kind, values = str(thing.unit.dimension), value_type(thing.type), thing.values
        found.append(Variable(f"memory.past_{name}", kind, unit, size, about, values))
        for group in ("past", "after"):
            found.append(Variable(f"work.{group}_{name}", kind, unit, values=values))
    return found


def _size(automaton: Automaton) -> int:
    return max(rewinding.ticks for rewinding in rewinds_of(automaton))


def _is_last(size: int) -> Expr:
    return Compare(">=", NEWEST, whole(size - 1))


def _all_reads(mode: Mode, wanted: Iterable[str]) -> set[str]:
    """Return the names that some names of a mode are made of."""
    found, known = set(wanted), sources(mode)
    for name in closure(mode, found):
        found |= {read for formula in known[name] for read in formula.reads}
    return found
