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

from language.ir.ops import (
    Assign,
    Block,
    Branch,
    Compare,
    Count,
    Expr,
    Item,
    Op,
    Ref,
    Select,
    Store,
    Switch,
    Value,
    add,
    integer,
    subtract,
)
from language.ir.program import Variable, value_type
from language.lowering.constants import evaluate_exactly
from language.lowering.expressions import variable_bindings
from language.lowering.program_builder import any_fired_condition
from language.model.analysis_cache import cache_on_owner
from language.model.automaton import Automaton, Mode, Rewind, Transition
from language.model.region_queries import equation_closure, equation_formulas

HISTORY_LENGTH = Ref("timer.past", is_integer=True)
"""How many places belong to this activation of the mode."""
NEWEST_INDEX = Ref("memory.newest", is_integer=True)
HISTORY_INDEX = Ref("work.place", is_integer=True)


@dataclass(frozen=True)
class Rollback:
    """A transition of an automaton that goes back."""

    automaton: Automaton
    source: Mode
    transition: Transition
    rewind: Rewind

    @property
    def max_ticks(self) -> int:
        """The ticks that it looks back, rounded up exactly (rule 4)."""
        assert self.automaton.period is not None
        return math.ceil(
            evaluate_exactly(self.rewind.within, self.automaton) / self.automaton.period
        )

    @property
    def flow_mode(self) -> str | None:
        """The mode of the model whose flow leads back; None where the states stand still."""
        if self.source.run:
            return self.source.run.mode
        return self.source.observer.of if self.source.observer else None

    @property
    def block_suffix(self) -> str:
        """The ending of its blocks: names may hold `_`, so its place among those of its mode."""
        return f"{self.source.name}_{self.source.transitions.index(self.transition)}"

    @property
    def names_read_by_jump(self) -> list[str]:
        """The names that the exit and the reset read."""
        written = (*self.source.exit.values(), *self.transition.reset.values())
        return [name for formula in written for name in formula.reads]


@cache_on_owner
def rollbacks_of(automaton: Automaton) -> tuple[Rollback, ...]:
    """Return the transitions of an automaton that go back."""
    modes = automaton.modes.values()
    return tuple(rewinding for mode in modes for rewinding in rollbacks_from(automaton, mode))


def rollbacks_from(automaton: Automaton, mode: Mode) -> list[Rollback]:
    """Return the transitions that leave a mode of the chart and go back."""
    return [
        Rollback(automaton, mode, transition, transition.rewind)
        for transition in mode.transitions
        if transition.rewind
    ]


@cache_on_owner
def rollback_targets(automaton: Automaton) -> frozenset[str]:
    """Return the modes that a transition enters which goes back."""
    return frozenset(rewinding.transition.target for rewinding in rollbacks_of(automaton))


def rolled_back_states(automaton: Automaton) -> tuple[str, ...]:
    """Return the states that a rewind takes back: those of the model."""
    assert automaton.model
    return tuple(automaton.model.states)


def record_tick_history(automaton: Automaton) -> Block:
    """Return what a tick keeps, once it has jumped."""
    rewinds = rollbacks_of(automaton)
    if not rewinds:
        return ()
    size = _history_size(automaton)
    keep: Block = (
        Assign(
            NEWEST_INDEX.name,
            Select(_is_last_index(size), integer(0), add(NEWEST_INDEX, integer(1))),
        ),
        *(
            Store(f"memory.past_{n}", NEWEST_INDEX, Ref(f"state.{n}"))
            for n in rolled_back_states(automaton)
        ),
        *(
            Store(f"memory.past_{n}", NEWEST_INDEX, ref)
            for n, ref in recorded_inputs(automaton).items()
        ),
        Count(HISTORY_LENGTH.name, Value(True), size),
    )
    numbers = dict.fromkeys(rewinding.source.number for rewinding in rewinds)
    return (
        Branch(any_fired_condition(automaton), (Assign(HISTORY_LENGTH.name, integer(0)),)),
        Switch("memory.mode", tuple((number, keep) for number in numbers)),
    )


@cache_on_owner
def recorded_inputs(automaton: Automaton) -> dict[str, Ref]:
    """Return the inputs that are kept: what runs, `until`, exit, reset and entry read."""
    read: set[str] = set()
    for rewinding in rollbacks_of(automaton):
        target = automaton.target_mode(rewinding.transition)
        entered = [name for formula in target.entry.values() for name in formula.reads]
        asked = [*rewinding.rewind.until.reads, *rewinding.names_read_by_jump]
        read |= _transitive_reads(rewinding.source, asked) | _transitive_reads(target, entered)
        read |= {*automaton.model.inputs} if automaton.model else set()
    names = variable_bindings(automaton, "input")
    found = {name: names[name] for name in automaton.inputs if name in read}
    return {name: ref for name, ref in found.items() if isinstance(ref, Ref)}


def run_inputs(automaton: Automaton) -> list[str]:
    """Return the inputs that the runs of an automaton read."""
    assert automaton.model
    return [name for name in automaton.inputs if name in automaton.model.inputs]


def recorded_input_ref(
    automaton: Automaton, name: str, group: Literal["past", "after"] = "past"
) -> Ref:
    """Return an input at the point that is looked at, or at the tick after it."""
    return Ref(f"work.{group}_{name}", recorded_inputs(automaton)[name].is_integer)


def set_history_index(automaton: Automaton, ticks_back: Expr) -> Block:
    """Return what finds the place of the tick so many places before the newest one."""
    around = Assign(HISTORY_INDEX.name, add(HISTORY_INDEX, integer(_history_size(automaton))))
    find = Assign(HISTORY_INDEX.name, subtract(NEWEST_INDEX, ticks_back))
    return (find, Branch(Compare("<", HISTORY_INDEX, integer(0)), (around,)))


def load_recorded_states(automaton: Automaton, group: Literal["at", "after"]) -> list[Op]:
    """Return what takes the states from a place of the rings."""
    return [
        Assign(f"work.{group}_{name}", Item(f"memory.past_{name}", HISTORY_INDEX))
        for name in rolled_back_states(automaton)
    ]


def load_current_states(automaton: Automaton, group: Literal["at", "after"]) -> list[Op]:
    """Return what takes the states as they are now."""
    names = rolled_back_states(automaton)
    return [Assign(f"work.{group}_{name}", Ref(f"state.{name}")) for name in names]


def load_recorded_inputs(automaton: Automaton, group: Literal["past", "after"]) -> list[Op]:
    """Return what takes the inputs from a place of the rings."""
    return [
        Assign(
            recorded_input_ref(automaton, name, group).name,
            Item(f"memory.past_{name}", HISTORY_INDEX, ref.is_integer),
        )
        for name, ref in recorded_inputs(automaton).items()
    ]


def load_current_inputs(automaton: Automaton, group: Literal["past", "after"]) -> list[Op]:
    """Return what takes the inputs as they are now."""
    kept = recorded_inputs(automaton).items()
    return [Assign(recorded_input_ref(automaton, name, group).name, ref) for name, ref in kept]


def load_recorded_run_inputs(automaton: Automaton) -> list[Op]:
    """Return what puts the inputs of a place of the rings where runs read those of before."""
    kept = recorded_inputs(automaton)
    items = {
        n: Item(f"memory.past_{n}", HISTORY_INDEX, kept[n].is_integer)
        for n in run_inputs(automaton)
    }
    return [Assign(f"before.{name}", item) for name, item in items.items()]


def tick_history_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables of what is kept, and of the points that are taken from it."""
    if not rollbacks_of(automaton):
        return []
    size = _history_size(automaton)
    about = f"of {size} ticks" if size > 1 else "of the tick before"
    found = [
        Variable(
            HISTORY_LENGTH.name, "whole", about=f"ticks kept of this activation, at most {size}"
        ),
        Variable(NEWEST_INDEX.name, "whole", about="which of the kept ticks is the newest"),
        Variable(HISTORY_INDEX.name, "whole"),
    ]
    for name in rolled_back_states(automaton):
        unit = str(automaton.states[name].unit.dimension)
        found.append(Variable(f"memory.past_{name}", "real", unit, size, about))
        found.append(Variable(f"work.after_{name}", "real", unit))
    for name in recorded_inputs(automaton):
        thing = automaton.inputs[name]
        unit, kind, values = str(thing.unit.dimension), value_type(thing.type), thing.values
        found.append(Variable(f"memory.past_{name}", kind, unit, size, about, values))
        for group in ("past", "after"):
            found.append(Variable(f"work.{group}_{name}", kind, unit, values=values))
    return found


def _history_size(automaton: Automaton) -> int:
    return max(rewinding.max_ticks for rewinding in rollbacks_of(automaton))


def _is_last_index(size: int) -> Expr:
    return Compare(">=", NEWEST_INDEX, integer(size - 1))


def _transitive_reads(mode: Mode, names: Iterable[str]) -> set[str]:
    """Return the names that some names of a mode are made of."""
    found, known = set(names), equation_formulas(mode)
    for name in equation_closure(mode, found):
        found |= {read for formula in known[name] for read in formula.reads}
    return found
