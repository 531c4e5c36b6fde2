"""Tick history: recorded states and inputs of a sampled automaton for transitions with `rewind`.

Ring buffers of the states of the model and of the inputs that are needed. A tick writes them after
its jump while a mode is active that a transition with `rewind` leaves. A counter limits reading to
the ticks of this activation of the mode.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from language.ir.analysis_cache import cache_on_owner
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
from language.lowering.action_stages import TransitionStages, stage_reads, transition_stages
from language.lowering.constants import evaluate_exactly
from language.lowering.expressions import variable_bindings
from language.lowering.program_builder import any_fired_condition
from language.model.automaton import Automaton, Mode, Rewind, Transition
from language.model.region_queries import equation_closure, equation_formulas

HISTORY_LENGTH = Ref("timer.past", is_integer=True)
"""The number of recorded ticks of this activation of the mode."""
NEWEST_INDEX = Ref("memory.newest", is_integer=True)
"""The index of the newest tick in the ring buffers."""
HISTORY_INDEX = Ref("work.place", is_integer=True)
"""The index of the tick that is read."""


@dataclass(frozen=True)
class Rollback:
    """A transition with `rewind`, with its automaton and its source."""

    automaton: Automaton
    source: Mode
    transition: Transition
    rewind: Rewind

    @property
    def max_ticks(self) -> int:
        """The number of ticks in `within`, rounded up exactly (rule 4a)."""
        assert self.automaton.period is not None
        return math.ceil(
            evaluate_exactly(self.rewind.within, self.automaton) / self.automaton.period
        )

    @property
    def flow_mode(self) -> str | None:
        """The mode of the model whose flow the source follows.

        It is that of its run, else that of its observer; None if it has neither.
        """
        if self.source.run:
            return self.source.run.mode
        return self.source.observer.of if self.source.observer else None

    @property
    def block_suffix(self) -> str:
        """The suffix of its blocks: `<mode>_<index>`, the index is that in the mode, from 0."""
        return f"{self.source.name}_{self.source.transitions.index(self.transition)}"

    @property
    def names_read_by_jump(self) -> list[str]:
        """The names that the exit and the reset read, with repetitions."""
        return stage_reads(self.stages.before)

    @property
    def stages(self) -> TransitionStages:
        """The stages of the transition."""
        return transition_stages(self.automaton, self.transition)


@cache_on_owner
def rollbacks_of(automaton: Automaton) -> tuple[Rollback, ...]:
    """Return the transitions with `rewind` of the modes of the chart, in the order of the file."""
    modes = automaton.modes.values()
    return tuple(rollback for mode in modes for rollback in rollbacks_from(automaton, mode))


def rollbacks_from(automaton: Automaton, mode: Mode) -> list[Rollback]:
    """Return the transitions with `rewind` that leave a mode of the chart, in file order."""
    return [
        Rollback(automaton, mode, transition, transition.rewind)
        for transition in mode.transitions
        if transition.rewind
    ]


@cache_on_owner
def rollback_targets(automaton: Automaton) -> frozenset[str]:
    """Return the names of the modes that a transition with `rewind` enters."""
    return frozenset(rollback.transition.target for rollback in rollbacks_of(automaton))


def rolled_back_states(automaton: Automaton) -> tuple[str, ...]:
    """Return the names of the states that a rollback restores: all states of the model."""
    assert automaton.model
    return tuple(automaton.model.states)


def record_tick_history(automaton: Automaton) -> Block:
    """Return the operations that record a tick after its jump; none without a rollback.

    If a transition has fired, the history is cleared first. The tick, with the states of the model
    and the recorded inputs, is stored if the active mode is the source of a rollback.
    """
    rollbacks = rollbacks_of(automaton)
    if not rollbacks:
        return ()
    size = _history_size(automaton)
    record: Block = (
        Assign(
            NEWEST_INDEX.name,
            Select(
                Compare(">=", NEWEST_INDEX, integer(size - 1)),
                integer(0),
                add(NEWEST_INDEX, integer(1)),
            ),
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
    numbers = dict.fromkeys(rollback.source.number for rollback in rollbacks)
    return (
        Branch(any_fired_condition(automaton), (Assign(HISTORY_LENGTH.name, integer(0)),)),
        Switch("memory.mode", tuple((number, record) for number in numbers)),
    )


@cache_on_owner
def recorded_inputs(automaton: Automaton) -> dict[str, Ref]:
    """Return the variables of the inputs to record, by name, in the order of the file.

    They are the inputs of the model and those that `until`, exit and reset of a rollback and the
    entry of its target read, directly or through equations. An input with a range is
    `latched.<name>`. The dict is empty without rollbacks.
    """
    read: set[str] = set()
    for rollback in rollbacks_of(automaton):
        target = automaton.target_mode(rollback.transition)
        own_reads = [*rollback.rewind.until.reads, *rollback.names_read_by_jump]
        read |= _transitive_reads(rollback.source, own_reads)
        read |= _transitive_reads(target, stage_reads(rollback.stages.after))
        read |= {*automaton.model.inputs} if automaton.model else set()
    names = variable_bindings(automaton, "input")
    recorded = {name: names[name] for name in automaton.inputs if name in read}
    return {name: ref for name, ref in recorded.items() if isinstance(ref, Ref)}


def run_inputs(automaton: Automaton) -> list[str]:
    """Return the names of the inputs of an automaton that its model has too, in its order."""
    assert automaton.model
    return [name for name in automaton.inputs if name in automaton.model.inputs]


def recorded_input_ref(
    automaton: Automaton, name: str, group: Literal["past", "after"] = "past"
) -> Ref:
    """Return the variable `work.<group>_<name>` of a recorded input.

    `past` is the examined tick, `after` the one after it. Raises KeyError for another input.
    """
    return Ref(f"work.{group}_{name}", recorded_inputs(automaton)[name].is_integer)


def set_history_index(automaton: Automaton, ticks_back: Expr) -> Block:
    """Return the operations that set the read index to `ticks_back` ticks before the newest one.

    The index wraps once around the ring buffer, so `ticks_back` must be less than its size.
    """
    wrap = Assign(HISTORY_INDEX.name, add(HISTORY_INDEX, integer(_history_size(automaton))))
    move = Assign(HISTORY_INDEX.name, subtract(NEWEST_INDEX, ticks_back))
    return (move, Branch(Compare("<", HISTORY_INDEX, integer(0)), (wrap,)))


def load_recorded_states(automaton: Automaton, group: Literal["at", "after"]) -> list[Op]:
    """Return the operations that copy the recorded states at the read index to work variables.

    The variables are `work.<group>_<name>` for all states of the model.
    """
    return [
        Assign(f"work.{group}_{name}", Item(f"memory.past_{name}", HISTORY_INDEX))
        for name in rolled_back_states(automaton)
    ]


def load_current_states(automaton: Automaton, group: Literal["at", "after"]) -> list[Op]:
    """Return the operations that copy the present states to `work.<group>_<name>`.

    The states are all those of the model.
    """
    names = rolled_back_states(automaton)
    return [Assign(f"work.{group}_{name}", Ref(f"state.{name}")) for name in names]


def load_recorded_inputs(automaton: Automaton, group: Literal["past", "after"]) -> list[Op]:
    """Return the operations that copy the recorded inputs at the read index to work variables.

    The inputs are those of `recorded_inputs`, the variables `work.<group>_<name>`: `past` for the
    examined tick, `after` for the one after it.
    """
    return [
        Assign(
            recorded_input_ref(automaton, name, group).name,
            Item(f"memory.past_{name}", HISTORY_INDEX, ref.is_integer),
        )
        for name, ref in recorded_inputs(automaton).items()
    ]


def load_current_inputs(automaton: Automaton, group: Literal["past", "after"]) -> list[Op]:
    """Return the operations that copy the present values of the recorded inputs to work variables.

    The inputs are those of `recorded_inputs`, the variables `work.<group>_<name>`: `past` for the
    examined tick, `after` for the one after it.
    """
    recorded = recorded_inputs(automaton).items()
    return [Assign(recorded_input_ref(automaton, name, group).name, ref) for name, ref in recorded]


def load_recorded_run_inputs(automaton: Automaton) -> list[Op]:
    """Return the operations that copy inputs at the read index to `before.<name>`.

    The inputs are those of `run_inputs`, which the model has too.
    """
    recorded = recorded_inputs(automaton)
    items = {
        n: Item(f"memory.past_{n}", HISTORY_INDEX, recorded[n].is_integer)
        for n in run_inputs(automaton)
    }
    return [Assign(f"before.{name}", item) for name, item in items.items()]


def tick_history_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables of the history and of values read from it; none without a rollback.

    Each state and each recorded input has a ring buffer `memory.past_<name>` of the longest
    `within` in ticks.
    """
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
    """Return the number of ticks that the ring buffers hold: the longest `within`."""
    return max(rollback.max_ticks for rollback in rollbacks_of(automaton))


def _transitive_reads(mode: Mode, names: Iterable[str]) -> set[str]:
    """Return the names and all names that the equations behind them read in a mode."""
    reads, known = set(names), equation_formulas(mode)
    for name in equation_closure(mode, reads):
        reads |= {read for formula in known[name] for read in formula.reads}
    return reads
