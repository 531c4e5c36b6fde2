"""Action: entry, exit, reset and update as stages of assignments, each committed as a whole.

Rules 5 and 6: a stage reads the values before it and commits all of its assignments together; of a
transition the stages are the exit of the source, the reset, the entry of the target.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from language.declaration import Formula
from language.limit import stored
from language.lower import WHOLE_TYPES, Names, assigned, equations, reads_of
from language.model import Automaton, Mode, Transition
from language.operation import Assign, Block, Choose, Op, Ref
from language.program import Variable, value_type
from language.region import sources
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


def stage_of_regions(
    automaton: Automaton,
    taken: Callable[[str], str],
    number: Callable[[Transition], int],
    written: Callable[[Transition], Mapping[str, Formula]],
    known: Names,
) -> Block:
    """Return one stage of the transitions that all regions take: all read, then all commit.

    `taken` is the variable of a region that holds the number of its transition, 0 for none.
    """
    reads: list[Op] = []
    commits: list[Op] = []
    for region in automaton.all_regions:
        ways = [way for mode in region.modes.values() for way in mode.transitions if written(way)]
        numbers = [number(way) for way in ways]
        read = [tuple(reading(automaton, written(way), known)) for way in ways]
        commit = [tuple(committing(automaton, written(way))) for way in ways]
        if ways:
            reads.append(Choose(taken(region.name), tuple(zip(numbers, read, strict=True))))
            commits.append(Choose(taken(region.name), tuple(zip(numbers, commit, strict=True))))
    return (*reads, *commits)


def entry(
    automaton: Automaton, target: Mode, written: Mapping[str, Formula], known: Names
) -> Block:
    """Return the entry of modes: it reads the equations of a mode of the chart after the reset."""
    if not written:
        return ()
    inside = {name: place for name, place in known.items() if name not in sources(target)}
    wanted = reads_of(formula.tree for formula in written.values())
    ops = equations(target, inside, "equation.", f"{automaton.name} ", wanted)
    return (*ops, *stage(automaton, written, inside))


def first_entry(automaton: Automaton) -> dict[str, Formula]:
    """Return what the entry of the initial modes of all regions writes."""
    initial = [region.modes[region.initial] for region in automaton.all_regions]
    return {name: formula for mode in initial for name, formula in mode.entry.items()}


def action_variables(automaton: Automaton) -> list[Variable]:
    """Return the work variables of all stages."""
    found: dict[str, Variable] = {}
    for mode in automaton.all_modes:
        resets = [transition.reset for transition in mode.transitions]
        for formulas in (*resets, mode.entry, mode.exit):
            for name in sorted(formulas):
                found[f"reset_{name}"] = work_variable(automaton, "reset", name)
        for name in mode.update:
            found[f"next_{name}"] = work_variable(automaton, "next", name)
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


def work_variable(automaton: Automaton, verb: str, name: str) -> Variable:
    """Return the variable of what a stage has computed and not yet committed."""
    thing = automaton.carried[name]
    unit = str(thing.unit.dimension)
    kind = value_type(thing.type)
    return Variable(f"work.{verb}_{name}", kind, unit, values=thing.values)
