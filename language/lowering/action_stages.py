"""Actions: entry, exit, reset and update as stages of assignments (rules 5 and 6).

All assignments of a stage read the values before the stage, then all are stored:

    x: y        ->    work.reset_x = state.y
    y: x              work.reset_y = state.x
                      state.x = work.reset_x
                      state.y = work.reset_y

The stages of a transition are the exit of the source, the reset and the entry of the target.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from language.ir.ops import Assign, Block, Op, Ref, Switch
from language.ir.program import Variable, value_type
from language.lowering.expressions import (
    WHOLE_TYPES,
    NameBindings,
    lower_assigned_value,
    lower_equations,
    names_read,
)
from language.lowering.program_builder import event_range
from language.lowering.range_saturation import store_saturated
from language.model.automaton import Automaton, Mode, Transition
from language.model.declaration import Formula
from language.model.region_queries import equation_formulas


def storage_of(automaton: Automaton, name: str) -> str:
    """Return the variable of a state or discrete variable: `state.<name>` or `discrete.<name>`."""
    return f"{'discrete' if name in automaton.discrete else 'state'}.{name}"


def lower_stage(
    automaton: Automaton,
    formulas: Mapping[str, Formula],
    known: NameBindings,
) -> list[Op]:
    """Return the operations of one stage: all assignments are evaluated, then all are stored.

    `formulas` are by variable, `known` the names before the stage. See `read_stage` and
    `commit_stage`.
    """
    return [
        *read_stage(automaton, formulas, known),
        *commit_stage(automaton, formulas),
    ]


def read_stage(
    automaton: Automaton,
    formulas: Mapping[str, Formula],
    known: NameBindings,
    stage_name: str = "reset",
) -> list[Op]:
    """Return the first half of a stage: `work.<stage>_<name> = <value>` for each assignment.

    The value is converted to a whole number for an int or an enumeration, else to a real. The key
    path is that of the formula after the name of the automaton.
    """
    found: list[Op] = []
    for name, formula in formulas.items():
        value = lower_assigned_value(
            formula.tree, known, automaton.state_variables[name].type in WHOLE_TYPES
        )
        key = f"{automaton.name} {formula.key}"
        found.append(Assign(f"work.{stage_name}_{name}", value, key))
    return found


def commit_stage(automaton: Automaton, names: Iterable[str], stage_name: str = "reset") -> list[Op]:
    """Return the second half of a stage: each `work.<stage>_<name>` is stored in its variable.

    In a sampled automaton a value outside the range of its variable is saturated (rule 18).
    """
    found: list[Op] = []
    for name in names:
        whole = automaton.state_variables[name].type in WHOLE_TYPES
        found += store_saturated(automaton, name, Ref(f"work.{stage_name}_{name}", whole))
    return found


def lower_stage_of_regions(
    automaton: Automaton,
    selected_variable: Callable[[str], str],
    number_of: Callable[[Transition], int],
    assignments_of: Callable[[Transition], Mapping[str, Formula]],
    known: NameBindings,
) -> Block:
    """Return one stage of the transitions that all regions take: all read, then all commit.

    `selected_variable` gives the variable of a region that holds the number of its transition, 0
    for none. `number_of` and `assignments_of` give the number and the assignments of a transition.
    Each half is a Switch for each region; a region whose transitions assign nothing has none.
    """
    reads: list[Op] = []
    commits: list[Op] = []
    for region in automaton.all_regions:
        transitions = [
            transition
            for mode in region.modes.values()
            for transition in mode.transitions
            if assignments_of(transition)
        ]
        numbers = [number_of(transition) for transition in transitions]
        read = [
            tuple(read_stage(automaton, assignments_of(transition), known))
            for transition in transitions
        ]
        commit = [
            tuple(commit_stage(automaton, assignments_of(transition))) for transition in transitions
        ]
        if transitions:
            reads.append(
                Switch(selected_variable(region.name), tuple(zip(numbers, read, strict=True)))
            )
            commits.append(
                Switch(selected_variable(region.name), tuple(zip(numbers, commit, strict=True)))
            )
    return (*reads, *commits)


def lower_entry(
    automaton: Automaton, target: Mode, assignments: Mapping[str, Formula], known: NameBindings
) -> Block:
    """Return the entry actions of `target` as one stage, or nothing if there are no assignments.

    The equations of the target that the entry reads, directly or indirectly, are evaluated first as
    `equation.<name>`. Names in `known` that are equations of the target are ignored.
    """
    if not assignments:
        return ()
    inside = {name: place for name, place in known.items() if name not in equation_formulas(target)}
    required = names_read(formula.tree for formula in assignments.values())
    ops = lower_equations(target, inside, "equation.", f"{automaton.name} ", required)
    return (*ops, *lower_stage(automaton, assignments, inside))


def initial_entry_assignments(automaton: Automaton) -> dict[str, Formula]:
    """Return the entry assignments of the initial modes of all regions, by variable.

    If several modes assign one variable, the last region counts.
    """
    initial = [region.modes[region.initial] for region in automaton.all_regions]
    return {name: formula for mode in initial for name, formula in mode.entry.items()}


def action_variables(automaton: Automaton) -> list[Variable]:
    """Return the `work` variables of all stages, each once.

    They are `work.reset_<name>` for variables that a reset, an entry or an exit assigns, and
    `work.next_<name>` for those that an update assigns.
    """
    found: dict[str, Variable] = {}
    for mode in automaton.all_modes:
        resets = [transition.reset for transition in mode.transitions]
        for formulas in (*resets, mode.entry, mode.exit):
            for name in sorted(formulas):
                found[f"reset_{name}"] = stage_variable(automaton, "reset", name)
        for name in mode.update:
            found[f"next_{name}"] = stage_variable(automaton, "next", name)
    return list(found.values())


def discrete_variables(automaton: Automaton) -> list[Variable]:
    """Return `discrete.<name>` for each discrete variable, in the order of the file.

    They have type, unit, values and, in a continuous automaton, the range.
    """
    return [
        Variable(
            f"discrete.{name}",
            value_type(thing.type),
            str(thing.unit.dimension),
            about=thing.key,
            values=thing.values,
            range=event_range(automaton, thing),
        )
        for name, thing in automaton.discrete.items()
    ]


def stage_variable(automaton: Automaton, stage_name: str, name: str) -> Variable:
    """Return a new variable `work.<stage>_<name>`, which holds a value before it is stored.

    Type, unit and values are those of the state or discrete variable `name`.
    """
    thing = automaton.state_variables[name]
    unit = str(thing.unit.dimension)
    kind = value_type(thing.type)
    return Variable(f"work.{stage_name}_{name}", kind, unit, values=thing.values)
