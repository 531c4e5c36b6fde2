"""Field: rates and guards of a continuous automaton at the point `work.at_<state>`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from language.lower import Names, equations, expression, rate, reads_of
from language.model import Automaton, Mode, Transition
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
from language.program import Variable


@dataclass(frozen=True)
class Field:
    """A continuous automaton where it moves: on its own, or as a run inside a tick.

    `inputs` are what its inputs read; `mode` is the variable that holds its mode.
    """

    automaton: Automaton
    constants: Names
    inputs: Names
    mode: str
    prefix: str

    @property
    def states(self) -> tuple[str, ...]:
        """The names of the states, in the order of the file."""
        return tuple(self.automaton.states)

    @property
    def widest(self) -> int:
        """The largest number of transitions that leave one mode."""
        return max(len(mode.transitions) for mode in self.automaton.modes.values())


def by_priority(mode: Mode) -> list[tuple[int, Transition]]:
    """Return the transitions of a mode with their index, the smallest priority first."""
    pairs = list(enumerate(mode.transitions))
    return sorted(pairs, key=lambda pair: (pair[1].priority or 0, pair[0]))


def field_blocks(field: Field) -> dict[str, Block]:
    """Return `rates_<mode>`, `guards_<mode>` and `jump_<mode>` of every mode."""
    blocks: dict[str, Block] = {}
    for name, mode in field.automaton.modes.items():
        blocks[f"rates_{name}"] = _rates(field, mode)
        blocks[f"guards_{name}"] = _guards(field, mode)
    return blocks


def field_variables(field: Field) -> list[Variable]:
    """Return the work variables that the blocks of a field use."""
    dimensions = field.automaton.dimensions
    found = []
    for state, thing in field.automaton.states.items():
        unit = str(thing.unit.dimension)
        found.append(Variable(f"work.at_{state}", "real", unit))
        found.append(Variable(f"work.rate_{state}", "real", f"({unit})/s"))
    equations_read = {name for mode in field.automaton.modes.values() for name in mode.equations}
    for name in dict.fromkeys(
        name for mode in field.automaton.modes.values() for name in mode.equations
    ):
        if name in equations_read:
            kind = dimensions.get(name)
            found.append(Variable(f"work.at_{name}", "real" if kind else "truth", str(kind or "1")))
    found += [Variable(f"work.guard_{k}", "truth") for k in range(field.widest)]
    return found


def known_at(field: Field) -> dict[str, Expr]:
    """Return what the names of the automaton are at the point."""
    known: dict[str, Expr] = dict(field.constants)
    known.update(field.inputs)
    known.update({name: Ref(f"work.at_{name}") for name in field.states})
    return known


def at_state(field: Field) -> list[Op]:
    """Return the operations that put the point where the states are."""
    return [Assign(f"work.at_{name}", Ref(f"state.{name}")) for name in field.states]


def by_mode(field: Field, verb: str) -> Choose:
    """Return the choice of the block `<verb>_<mode>` of the mode that the field is in."""
    modes = field.automaton.modes.values()
    return Choose(field.mode, tuple((m.number, (Run(f"{verb}_{m.name}"),)) for m in modes))


def any_guard(mode: Mode, armed: Mapping[int, str] | None = None) -> Expr:
    """Return whether a guard of the mode is true (differs from what it was when armed)."""
    result: Expr = Value(False)
    for k in range(len(mode.transitions)):
        guard: Expr = Ref(f"work.guard_{k}")
        if armed is not None:
            guard = Compare("!=", guard, Ref(armed[k]))
        result = guard if k == 0 else Binary("or", result, guard)
    return result


def jump(field: Field, mode: Mode, enabled: Mapping[int, Expr], fire: Mapping[int, Block]) -> Block:
    """Return the choice of one transition: the enabled one with the smallest priority."""
    ops: Block = ()
    for k, transition in reversed(by_priority(mode)):
        taken = [*resets(field, transition), *fire[k]]
        ops = (Branch(enabled[k], tuple(taken), ops),)
    return ops


def resets(field: Field, transition: Transition) -> list[Op]:
    """Return a transition's resets: all read the values before, then all commit together."""
    known = known_at(field)
    mode = field.automaton.modes[transition.source]
    known.update({name: Ref(f"work.at_{name}") for name in mode.equations})
    first: list[Op] = []
    second: list[Op] = []
    for name, formula in transition.reset.items():
        value = expression(formula.tree, known)
        first.append(Assign(f"work.reset_{name}", value, field.prefix + formula.key))
        second.append(Assign(f"state.{name}", Ref(f"work.reset_{name}")))
    if len(first) == 1:
        value = first[0].value  # type: ignore[union-attr]
        return [Assign(f"state.{next(iter(transition.reset))}", value, first[0].key)]  # type: ignore[union-attr]
    return first + second


def enter(field: Field, transition: Transition) -> Assign:
    """Return the operation that makes a transition's target the mode of the field."""
    number = field.automaton.modes[transition.target].number
    return Assign(field.mode, whole(number))


def _rates(field: Field, mode: Mode) -> Block:
    known = known_at(field)
    wanted = reads_of(balance.right for balance in mode.flow.values())
    wanted += reads_of(balance.left for balance in mode.flow.values())
    ops = equations(mode, known, "work.at_", field.prefix, wanted)
    for name in field.states:
        balance = mode.flow[name]
        ops.append(Assign(f"work.rate_{name}", rate(balance, known), field.prefix + balance.key))
    return tuple(ops)


def _guards(field: Field, mode: Mode) -> Block:
    known = known_at(field)
    trees = [transition.when.tree for transition in mode.transitions]
    for transition in mode.transitions:
        trees += [formula.tree for formula in transition.reset.values()]
    ops = equations(mode, known, "work.at_", field.prefix, reads_of(trees))
    for k, transition in enumerate(mode.transitions):
        guard = expression(transition.when.tree, known)
        ops.append(Assign(f"work.guard_{k}", guard, field.prefix + transition.when.key))
    return tuple(ops)
