"""Action: entry, exit, reset and update as stages of assignments, each committed as a whole.

Rules 5 and 6: a stage reads the values before it and commits all of its assignments together; of a
transition the stages are the exit of the source, the reset, the entry of the target.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from language.declaration import Formula
from language.limit import stored
from language.lower import WHOLE_TYPES, Names, assigned, equations, reads_of
from language.model import Automaton, Mode
from language.operation import Assign, Block, Op, Ref
from language.program import Variable, value_type
from language.wiring import watched_range


def place_of(automaton: Automaton, name: str) -> str:
    """Return the variable of a state or discrete variable."""
    return f"{'discrete' if name in automaton.discrete else 'state'}.{name}"


def stage(
    automaton: Automaton, formulas: Mapping[str, Formula], known: Names, verb: str = "reset"
) -> list[Op]:
    """Return assignments that all read the values before, then commit together."""
    return [*reading(automaton, formulas, known, verb), *committing(automaton, formulas, verb)]


def reading(
    automaton: Automaton, formulas: Mapping[str, Formula], known: Names, verb: str = "reset"
) -> list[Op]:
    """Return what reads the values before a stage."""
    found: list[Op] = []
    for name, formula in formulas.items():
        value = assigned(formula.tree, known, automaton.carried[name].type in WHOLE_TYPES)
        key = f"{automaton.name} {formula.key}"
        found.append(Assign(f"work.{verb}_{name}", value, key))
    return found


def committing(automaton: Automaton, written: Iterable[str], verb: str = "reset") -> list[Op]:
    """Return what commits the assignments of a stage together."""
    found: list[Op] = []
    for name in written:
        whole = automaton.carried[name].type in WHOLE_TYPES
        found += stored(automaton, name, Ref(f"work.{verb}_{name}", whole))
    return found


def entry(automaton: Automaton, target: Mode, known: Names) -> Block:
    """Return the entry of a mode: it reads its mode's equations as they are after the reset."""
    if not target.entry:
        return ()
    inside = {name: place for name, place in known.items() if name not in target.equations}
    wanted = reads_of(formula.tree for formula in target.entry.values())
    ops = equations(target, inside, "equation.", f"{automaton.name} ", wanted)
    return (*ops, *stage(automaton, target.entry, inside))


def action_variables(automaton: Automaton) -> list[Variable]:
    """Return the work variables of all stages."""
    found: dict[str, Variable] = {}
    for mode in automaton.all_modes:
        resets = [transition.reset for transition in mode.transitions]
        for formulas in (*resets, mode.entry, mode.exit):
            for name in sorted(formulas):
                found[f"reset_{name}"] = _work(automaton, "reset", name)
        for name in mode.update:
            found[f"next_{name}"] = _work(automaton, "next", name)
    return list(found.values())


def discrete_variables(automaton: Automaton) -> list[Variable]:
    """Return the discrete variables of an automaton."""
    return [
        Variable(
            f"discrete.{name}",
            value_type(thing.type),
            str(thing.unit.dimension),
            about=thing.key,
            values=thing.values,
            range=watched_range(automaton, thing),
        )
        for name, thing in automaton.discrete.items()
    ]


def _work(automaton: Automaton, verb: str, name: str) -> Variable:
    thing = automaton.carried[name]
    unit = str(thing.unit.dimension)
    kind = value_type(thing.type)
    return Variable(f"work.{verb}_{name}", kind, unit, values=thing.values)
