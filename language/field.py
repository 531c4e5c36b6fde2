"""Field: rates and guards of a continuous automaton at the point `work.at_<state>`."""

from __future__ import annotations

import dataclasses
from collections import ChainMap
from collections.abc import Mapping
from dataclasses import dataclass

from language.action import action_variables, committing, place_of, reading, stage
from language.declaration import Formula
from language.lower import Names, choice, equation_names, equations, expression, rate, reads_of
from language.model import Automaton, Balance, Mode, Transition
from language.once import once
from language.operation import (
    Assign,
    Binary,
    Block,
    Branch,
    Choose,
    Compare,
    Expr,
    Op,
    Ref,
    Run,
    Value,
    whole,
)
from language.program import Variable, mode_variable
from language.region import (
    all_slots,
    balances,
    by_priority,
    in_modes,
    region_of_balance,
    slot,
    slots,
    transitions,
)
from language.turning import levels, turned
from language.units import per_second
from language.wiring import equation_variables

ALWAYS = Value(True)
"""Of a transition that is taken where no other one is."""


@dataclass(frozen=True)
class Field:
    """A continuous automaton where it moves: on its own, or as a run inside a tick.

    `inputs` are what its inputs read; `mode` is the variable that holds its mode; `timed` says
    whether something changes with `work.s`, the time since the start of the step; `remembered` is
    what the guards of a mode (by its key) remember; `is_staged` is whether stages have blocks.
    """

    automaton: Automaton
    constants: Names
    inputs: Names
    mode: str
    prefix: str
    timed: bool = False
    remembered: Mapping[str, Names] = dataclasses.field(default_factory=dict)
    is_staged: bool = False

    @property
    def states(self) -> tuple[str, ...]:
        """The names of the states, in the order of the file."""
        return tuple(self.automaton.states)

    @property
    def slots(self) -> tuple[str, ...]:
        """The endings of the guard variables."""
        return tuple(all_slots(self.automaton))

    def mode_of(self, region: str) -> str:
        """Return the variable that holds the mode of a region."""
        return mode_variable(self.mode, region)


def field_blocks(field: Field) -> dict[str, Block]:
    """Return `rates_<mode>` and `guards_<mode>` of every mode."""
    blocks: dict[str, Block] = {}
    for region in field.automaton.regions:
        for mode in region.modes.values():
            blocks[f"guards_{mode.label}"] = tuple(_own_guards(field, mode, region.widest))
    for name, mode in field.automaton.modes.items():
        blocks[f"rates_{name}"] = _rates(field, mode)
        blocks[f"guards_{name}"] = _guards(field, mode)
    return blocks


def field_variables(field: Field) -> list[Variable]:
    """Return the work variables that the blocks of a field use."""
    found = []
    for state, thing in field.automaton.states.items():
        dimension = thing.unit.dimension
        about = "at the point that is looked at"
        found.append(Variable(f"work.at_{state}", "real", str(dimension), about=about))
        found.append(
            Variable(f"work.rate_{state}", "real", str(per_second(dimension)), about=about)
        )
    found += equation_variables(field.automaton, "work.at_")
    about = "a guard of the mode that flows, in the order of its transitions"
    found += [Variable(f"work.guard_{slot}", "truth", about=about) for slot in field.slots]
    found += action_variables(field.automaton)
    return found


def known_at(field: Field) -> dict[str, Expr]:
    """Return what the names of the automaton are at the point, to be added to."""
    return dict(_known_at(field))


@once
def _known_at(field: Field) -> dict[str, Expr]:
    known: dict[str, Expr] = dict(field.constants)
    known.update(field.inputs)
    known.update({name: Ref(f"work.at_{name}") for name in field.states})
    known.update(in_modes(field.automaton, field.mode))
    return known


@once
def all_known_at(field: Field) -> dict[str, Expr]:
    """Return what the names of the automaton are at the point, all equations among them."""
    known = known_at(field)
    known.update(equation_names(field.automaton, "work.at_"))
    return known


def at_state(field: Field) -> list[Op]:
    """Return the operations that put the point where the states are."""
    return [Assign(f"work.at_{name}", Ref(f"state.{name}")) for name in field.states]


def at_time(field: Field, time: Expr) -> list[Op]:
    """Return the operations that put the inputs where they are at a time of the step [s]."""
    return [Assign("work.s", time)] if field.timed else []


def by_mode(field: Field, verb: str) -> Choose:
    """Return the choice of the block `<verb>_<mode>` of the mode that the field is in."""
    modes = field.automaton.modes.values()
    return Choose(field.mode, tuple((m.number, (Run(f"{verb}_{m.name}"),)) for m in modes))


def any_guard(field: Field, mode: Mode, armed: Mapping[str, str] | None = None) -> Expr:
    """Return whether a guard of the mode is true (it or an edge's level is not as when armed)."""
    result: Expr = Value(False)
    for k, watched in enumerate(slots(mode)):
        guard: Expr = Ref(f"work.guard_{watched}")
        if armed is not None:
            guard = Compare("!=", guard, Ref(armed[watched]))
        result = guard if k == 0 else Binary("or", result, guard)
    for level in turned(field.automaton):
        result = Binary("or", result, level)
    return result


def jump(mode: Mode, enabled: Mapping[int, Expr], fire: Mapping[int, Block]) -> Block:
    """Return the choice of one transition: the enabled one with the smallest priority."""
    ops: Block = ()
    for k, _ in reversed(by_priority(mode)):
        ops = fire[k] if enabled[k] == ALWAYS else (Branch(enabled[k], fire[k], ops),)
    return ops


def resets(field: Field, transition: Transition) -> tuple[list[Op], list[Op]]:
    """Return a transition's resets: what reads the values before, then what commits."""
    automaton, known = field.automaton, all_known_at(field)
    return reading(automaton, transition.reset, known), committing(automaton, transition.reset)


def switch(
    field: Field, mode: Mode, enabled: Mapping[int, Expr], fired: Mapping[int, Block]
) -> Block:
    """Return one micro-step of an automaton that has no region beside the chart."""
    fire = {
        k: (*reset_at_once(field, transition), enter(field, transition), *fired.get(k, ()))
        for k, transition in enumerate(mode.transitions)
    }
    return jump(mode, enabled, fire)


def reset_at_once(field: Field, transition: Transition) -> list[Op]:
    """Return exit, reset and entry (rule 6) of a transition that nothing else fires beside."""
    source, target = field.automaton.source(transition), field.automaton.target(transition)
    if source.exit or target.entry:
        ops = stage(field.automaton, source.exit, all_known_at(field))
        ops += [op for op in at_state(field) if transition.reset]
        ops += stage(field.automaton, transition.reset, all_known_at(field))
        return [*ops, *entered(field, target, target.entry)]
    first, second = resets(field, transition)
    if len(first) == 1:
        (name,) = transition.reset
        (only,) = first
        assert isinstance(only, Assign)
        return [Assign(place_of(field.automaton, name), only.value, only.key)]
    return first + second


def entered(field: Field, target: Mode, written: Mapping[str, Formula]) -> list[Op]:
    """Return the entry of modes: it reads the equations of a mode of the chart after the reset."""
    if not written:
        return []
    known = known_at(field)
    wanted = reads_of(formula.tree for formula in written.values())
    ops = equations(target, known, "work.at_", field.prefix, wanted)
    return [*at_state(field), *ops, *stage(field.automaton, written, known)]


def enter(field: Field, transition: Transition) -> Assign:
    """Return the operation that makes a transition's target the mode of its region."""
    number = field.automaton.target(transition).number
    return Assign(field.mode_of(transition.region), whole(number))


def _rates(field: Field, mode: Mode) -> Block:
    known = known_at(field)
    wanted = reads_of(tree for balance in balances(mode) for tree in (balance.right, balance.left))
    ops = equations(mode, known, "work.at_", field.prefix, wanted)

    def rate_is(balance: Balance) -> Assign:
        target = f"work.rate_{balance.state}"
        return Assign(target, rate(balance, known), field.prefix + balance.key)

    for name in field.states:
        region = region_of_balance(mode, name)
        if region is None:
            ops.append(rate_is(mode.flow[name]))
        else:
            modes = region.modes.values()
            cases = {other.name: (rate_is(other.flow[name]),) for other in modes}
            ops.append(choice(region, known, cases))
    return tuple(ops)


def _guards(field: Field, mode: Mode) -> Block:
    """The guards of a mode of the chart, then those of the modes beside it, on its equations."""
    known = known_at(field)
    trees = [transition.when.tree for transition in transitions(mode)]
    for active in (mode, *(m for region in mode.beside for m in region.modes.values())):
        trees += [formula.tree for formula in active.exit.values()]
    for transition in transitions(mode):
        trees += [formula.tree for formula in transition.reset.values()]
    ops = equations(mode, known, "work.at_", field.prefix, reads_of(trees))
    ops += _own_guards(field, mode, len(mode.transitions))
    for region in mode.beside:
        modes = region.modes.values()
        cases: dict[str, Block] = {m.name: (Run(f"guards_{m.label}"),) for m in modes}
        ops.append(choice(region, known, cases))
    return tuple(ops)


def _own_guards(field: Field, mode: Mode, count: int) -> list[Op]:
    """Return what sets the guards of a mode, and those up to `count` to false."""
    known = ChainMap(dict(field.remembered.get(mode.key, {})), all_known_at(field))
    ops = levels(field.automaton, mode, known)
    for k, transition in enumerate(mode.transitions):
        guard = expression(transition.when.tree, known)
        target = f"work.guard_{slot(mode.region, k)}"
        ops.append(Assign(target, guard, field.prefix + transition.when.key))
    for k in range(len(mode.transitions), count):
        ops.append(Assign(f"work.guard_{slot(mode.region, k)}", Value(False)))
    return ops
