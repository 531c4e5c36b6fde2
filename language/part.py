"""Part: what an engine runs of a continuous automaton, block by block (continuous.py)."""

from __future__ import annotations

from language.action import first_entry
from language.constants import derive_block
from language.field import (
    Field,
    at_state,
    at_time,
    by_mode,
    entered,
)
from language.history import (
    AGE,
    History,
    alarms_of,
    fill_block,
    record_block,
)
from language.lower import Names, equation_names
from language.model import Automaton, Mode
from language.operation import (
    Assign,
    Binary,
    Block,
    Branch,
    Choose,
    Loop,
    Ref,
    Run,
    Unary,
    Value,
    real,
    whole,
)
from language.region import slots
from language.stepping import (
    Waits,
    begun,
    of_mode,
)
from language.turning import forgotten, settled
from language.wiring import (
    enter_initial,
    initial_ops,
    none_fired,
)


def parts_block(
    field: Field, known: Names, waits: Waits, histories: tuple[History, ...]
) -> dict[str, Block]:
    """What is run from outside."""
    automaton = field.automaton
    now = (*at_state(field), *at_time(field, real(0.0)))
    ends = [Assign(f"state.{name}", Ref(f"work.at_{name}")) for name in field.states]
    modes = automaton.modes.values()
    at_start = at_time(field, real(0.0))
    evaluate: Block = (*at_start, by_mode(field, "equations"))
    whole_known = {**known, **equation_names(automaton, "equation.")}
    # A delayed quantity may read another one: each round fills one more from what is inside it.
    rounds = (*evaluate, *fill_block(histories, whole_known))
    fill: Block = (Loop(len(histories), "work.round", rounds),) if histories else ()
    keep: Block = (*evaluate, *record_block(histories, whole_known), Assign(AGE.name, real(0.0)))
    record = {"record": keep} if histories else {}
    watch = tuple((mode.number, _watch(automaton, mode)) for mode in automaton.modes.values())
    return {
        "derive": derive_block(automaton),
        "init": (
            Assign("memory.started", Value(False)),
            *enter_initial(automaton, "memory.mode"),
            Assign("memory.faults", whole(0)),
        ),
        "start": (*_start(field, known, waits, histories), *fill),
        "equations": evaluate,
        **record,
        "watch": (*_silenced(automaton), *now, Choose("memory.mode", watch), Run("load")),
        "jump": (*none_fired(automaton), *now, by_mode(field, "jump")),
        "flow": (by_mode(field, "move"),),
        "dense": (Choose(field.mode, tuple((m.number, _dense(m)) for m in modes)),),
        "peek": (Run("point"), *ends),
    }


def _start(field: Field, known: Names, waits: Waits, histories: tuple[History, ...]) -> Block:
    """What a run begins with, at time 0 and in the initial mode (rule 16b)."""
    automaton = field.automaton
    begins = begun(waits)
    return (
        *initial_ops(automaton, known, field.prefix),
        *enter_initial(automaton, "memory.mode"),
        *(wait.load for wait in waits),
        *forgotten(automaton),
        *(op for r in automaton.all_regions for op in of_mode(begins, r.modes[r.initial])),
        *((Assign(AGE.name, real(0.0)),) if histories else ()),
        Assign("memory.time", real(0.0)),
        Assign("memory.started", Value(True)),
        *entered(field, automaton.modes[automaton.initial], first_entry(automaton)),
    )


def _silenced(automaton: Automaton) -> Block:
    """What repeats is true for one instant, which is over when guards are watched."""
    repeating = [alarm for alarm in alarms_of(automaton) if alarm.repeats]
    return tuple(Assign(alarm.variable, Value(False)) for alarm in repeating)


def _dense(mode: Mode) -> Block:
    """The polynomial of the flow that was just done, where no crossing was looked for on it."""
    run: Block = (Run(f"series_{mode.name}"),)
    is_known = Binary("or", Ref("work.crossed"), Ref("work.is_wait"))
    return (Branch(Unary("not", is_known), run),) if slots(mode) else run


def _watch(automaton: Automaton, mode: Mode) -> Block:
    armed = [Assign(f"memory.armed_{slot}", Ref(f"work.guard_{slot}")) for slot in slots(mode)]
    return (Run(f"guards_{mode.name}"), *armed, *settled(automaton))
