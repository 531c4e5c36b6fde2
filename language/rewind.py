"""Rewind: a transition that comes late is made where its `until` turned true, then carried on.

`back_<mode>_<place>` looks back from now for the latest tick at which `until` of a transition is
false: the crossing lies in the tick after it, on the flow of the source from the states and inputs
that were kept then, located by halvings. The micro-step is made there; the run of the target
carries the states over the rest of that tick and over each later one. Where `until` was true as far
back as is kept, or is false now, nothing is taken back and, unless it says otherwise, a fault bit
is set.
"""

from __future__ import annotations

from language.lower import Names, equations, expression
from language.model import Automaton, Mode
from language.motion import RUN_HALVINGS
from language.operation import (
    Assign,
    Binary,
    Block,
    Branch,
    Compare,
    Expr,
    FaultBit,
    Loop,
    Op,
    Ref,
    Run,
    Unary,
    add,
    multiply,
    real,
    subtract,
    whole,
)
from language.past import (
    KEPT,
    Rewinding,
    entered_late,
    find_place,
    input_at,
    inputs_as_now,
    inputs_at_place,
    kept_inputs,
    past_variables,
    rewinds_from,
    run_inputs,
    run_inputs_at_place,
    states_as_now,
    states_at_place,
    taken_back,
)
from language.program import Variable
from language.region import closure, sources
from language.resting import moving
from language.run import holding, run_block
from language.wiring import equation_variables

REWIND_LIMIT = "rewind_limit"
BACK = Ref("work.back", whole=True)
"""How many ticks before now `until` was false, 0: not found."""
LOOK = Ref("work.look", whole=True)
UNTIL = Ref("work.until")
REST = Ref("work.rest")


def rewind_blocks(automaton: Automaton, mode: Mode, now: Names) -> dict[str, Block]:
    """Return the blocks of the transitions of a mode that go back; `now` has no equations."""
    found: dict[str, Block] = {}
    for rewinding in rewinds_from(automaton, mode):
        found[f"until_{rewinding.label}"] = _until(rewinding, now)
        found[f"back_{rewinding.label}"] = _back(rewinding, now)
    return found


def advance_blocks(automaton: Automaton, mode: Mode) -> dict[str, Block]:
    """Return `run_<mode>`: its period; of what a rewind enters also `rest_<mode>`, a part of it."""
    if mode.run is None:
        return {}
    if mode.name not in entered_late(automaton):
        return {f"run_{mode.name}": run_block(automaton, mode.run)}
    assert automaton.period is not None
    period = Assign(REST.name, real(automaton.period), f"{automaton.name} {mode.run.key}")
    return {
        f"rest_{mode.name}": run_block(automaton, mode.run, REST),
        f"run_{mode.name}": (period, Run(f"rest_{mode.name}")),
    }


def known_there(automaton: Automaton, now: Names) -> dict[str, Expr]:
    """Return what names are where the micro-step is made, apart from equations."""
    return {**now, **{name: input_at(automaton, name) for name in kept_inputs(automaton)}}


def equations_there(rewinding: Rewinding) -> dict[str, Expr]:
    """Return the equations that exit and reset read, as they are there."""
    known = sources(rewinding.source)
    names = closure(rewinding.source, rewinding.read_by_jump)
    return {name: Ref(f"work.past_{name}", known[name][0].whole) for name in names}


def carry_on(rewinding: Rewinding) -> Block:
    """Return what the target's run does from the crossing to now."""
    automaton = rewinding.automaton
    target = automaton.target(rewinding.transition)
    ops: list[Op] = []
    if rewinding.flow is not None:
        ops.append(Branch(Compare(">", REST, real(0.0)), (Run(f"rest_{target.name}"),)))
    place = find_place(automaton, subtract(subtract(BACK, whole(2)), LOOK))
    inputs = run_inputs_at_place(automaton)
    later: Block = (
        *((*place, *inputs) if inputs else ()),
        Run(f"run_{target.name}"),
    )
    is_later = Compare("<", add(LOOK, whole(1)), BACK)
    if rewinding.ticks > 1:
        ops.append(Loop(rewinding.ticks - 1, LOOK.name, (Branch(is_later, later),)))
    return (Branch(Compare(">", BACK, whole(0)), tuple(ops)),) if ops else ()


def rewind_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables of all of it; `finished` leaves out what is not used."""
    return [
        *past_variables(automaton),
        Variable(BACK.name, "whole"),
        Variable(LOOK.name, "whole"),
        Variable(UNTIL.name, "truth"),
        Variable(REST.name, "real", "s", about="from the crossing to the end of its tick"),
        *equation_variables(automaton, "work.past_"),
    ]


def _until(rewinding: Rewinding, now: Names) -> Block:
    """Whether `until` holds at `work.at_<state>` with the inputs `work.past_<input>`."""
    known = known_there(rewinding.automaton, now)
    known.update({name: Ref(f"work.at_{name}") for name in taken_back(rewinding.automaton)})
    until, prefix = rewinding.rewind.until, f"{rewinding.automaton.name} "
    ops = equations(rewinding.source, known, "work.past_", prefix, until.reads)
    return (*ops, Assign(UNTIL.name, expression(until.tree, known), prefix + until.key))


def _back(rewinding: Rewinding, now: Names) -> Block:
    """Go back to where the micro-step is made, and evaluate what its exit and reset read there."""
    automaton = rewinding.automaton
    told: Block = (FaultBit(REWIND_LIMIT),) if rewinding.rewind.is_fault else ()
    limit: Block = (*told, *inputs_as_now(automaton, "past"))
    known, prefix = known_there(automaton, now), f"{automaton.name} "
    there = equations(rewinding.source, known, "work.past_", prefix, rewinding.read_by_jump)
    return (
        *_search(rewinding),
        Branch(Compare(">", BACK, whole(0)), _located(rewinding), limit),
        *there,
    )


def _search(rewinding: Rewinding) -> Block:
    """From now backwards to the latest tick at which `until` is false."""
    automaton, until = rewinding.automaton, Run(f"until_{rewinding.label}")
    is_wanted = Binary("and", Compare("==", BACK, whole(0)), Compare("<", LOOK, KEPT))
    look: Block = (
        *find_place(automaton, LOOK),
        *states_at_place(automaton, "at"),
        *inputs_at_place(automaton, "past"),
        until,
        Branch(Unary("not", UNTIL), (Assign(BACK.name, add(LOOK, whole(1))),)),
    )
    search = Loop(rewinding.ticks, LOOK.name, (Branch(is_wanted, look),))
    now = (*states_as_now(automaton, "at"), *inputs_as_now(automaton, "past"))
    return (*now, until, Assign(BACK.name, whole(0)), Branch(UNTIL, (search,)))


def _located(rewinding: Rewinding) -> Block:
    """The point is at the tick before the crossing: put the states at the crossing."""
    automaton = rewinding.automaton
    ring = (
        *find_place(automaton, subtract(BACK, whole(2))),
        *states_at_place(automaton, "after"),
        *inputs_at_place(automaton, "after"),
    )
    now = (*states_as_now(automaton, "after"), *inputs_as_now(automaton, "after"))
    ops: list[Op] = [Branch(Compare("==", BACK, whole(1)), now, ring)]
    there = [Assign(f"state.{name}", Ref(f"work.at_{name}")) for name in taken_back(automaton)]
    if rewinding.flow is None:
        return (*ops, *_tick_after(automaton), *there)
    before, held = _held_there(rewinding, rewinding.flow)
    return (*ops, *_along(rewinding), *before, *there, *held)


def _held_there(rewinding: Rewinding, flow: str) -> tuple[Block, Block]:
    """Return what stands before and after the states are put at the crossing: what moves there is
    held as after a segment of a run (rule 18), what rests is what it was at a tick.
    """
    automaton = rewinding.automaton
    run = automaton.target(rewinding.transition).run
    assert automaton.model and run
    return holding(automaton, run.method, moving(automaton.model, flow))


def _tick_after(automaton: Automaton) -> list[Op]:
    """The crossing is the tick itself: no flow leads to it, or a correction made it."""
    ops: list[Op] = [
        Assign(f"work.at_{name}", Ref(f"work.after_{name}")) for name in taken_back(automaton)
    ]
    for name in kept_inputs(automaton):
        ops.append(Assign(input_at(automaton, name).name, input_at(automaton, name, "after")))
    return [*ops, Assign(REST.name, real(0.0))]


def _along(rewinding: Rewinding) -> list[Op]:
    """One step of the flow of the source from the tick before; where it crosses, halve it."""
    automaton = rewinding.automaton
    assert automaton.period is not None
    names = taken_back(automaton)
    ends = [Assign(f"work.at_{name}", Ref(f"work.end_{name}")) for name in names]
    crossing: Block = (Run(f"series_{rewinding.flow}"), *_halved(rewinding), *ends)
    return [
        *(Assign(f"state.{name}", Ref(f"work.at_{name}")) for name in names),
        *_inputs_of_run(automaton),
        Assign("work.h", real(automaton.period)),
        Run(f"step_{rewinding.flow}"),
        *ends,
        Run(f"until_{rewinding.label}"),
        Branch(UNTIL, crossing, tuple(_tick_after(automaton))),
    ]


def _halved(rewinding: Rewinding) -> list[Op]:
    """Halve (low, high]: `until` holds at high, not at low; the upper end is kept."""
    low, high = Ref("work.low"), Ref("work.high")
    names = taken_back(rewinding.automaton)
    keep = [Assign(f"work.end_{name}", Ref(f"work.at_{name}")) for name in names]
    middle = add(low, multiply(real(0.5), subtract(high, low)))
    body: Block = (
        Assign("work.s", middle),
        Run("point"),
        Run(f"until_{rewinding.label}"),
        Branch(
            UNTIL, (Assign(high.name, Ref("work.s")), *keep), (Assign(low.name, Ref("work.s")),)
        ),
    )
    return [
        Assign(low.name, real(0.0)),
        Assign(high.name, Ref("work.h")),
        Loop(RUN_HALVINGS, "work.halving", body),
        Assign(REST.name, subtract(Ref("work.h"), high)),
    ]


def _inputs_of_run(automaton: Automaton) -> list[Op]:
    """Put the inputs of the point where runs read those of the tick before."""
    return [Assign(f"before.{name}", input_at(automaton, name)) for name in run_inputs(automaton)]
