"""Actions: the stages of transitions, their order and their lowering (rules 5 and 6).

Transitions that are taken together have the stages of `order_stages`, in this order:

    exit of the sources, from the inside out
    reset
    (the modes change)
    entry of the targets, from the outside in

All assignments of a stage read the values before the stage, then all are stored:

    x: y        ->    work.reset_x = state.y
    y: x              work.reset_y = state.x
                      state.x = work.reset_x
                      state.y = work.reset_y

A transition between modes without nesting has the stages of `transition_stages`, those of parallel
regions have `common_stages`. `lower_transition` lowers the stages. Checks and proofs read them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from language.ir.ops import Assign, Block, Branch, Op, Ref, Switch
from language.ir.program import Variable, value_type
from language.lowering.expressions import (
    WHOLE_TYPES,
    NameBindings,
    equation_bindings,
    lower_assigned_value,
    lower_equations,
)
from language.lowering.program_builder import event_range
from language.lowering.range_saturation import store_saturated
from language.model.automaton import Automaton, Mode, Transition
from language.model.declaration import Formula

Selection = tuple[str, int]
"""A variable and the value at which something is done; without a variable it is always done."""
ALWAYS: Selection = ("", 0)
"""The selection of what is always done."""


@dataclass(frozen=True)
class Action:
    """Assignments that are made if `selection` holds; `then` are operations after their stage."""

    assignments: Mapping[str, Formula]
    selection: Selection = ALWAYS
    then: Block = ()


Stage = tuple[Action, ...]
"""Actions whose assignments are simultaneous (rule 5)."""


@dataclass(frozen=True)
class TransitionStages:
    """The stages of transitions that are taken together, before and after the modes change.

    Those before read the equations of the source modes, those after the equations of the targets.
    """

    before: tuple[Stage, ...]
    after: tuple[Stage, ...]


def order_stages(
    sources: Iterable[tuple[Mode, int, Selection]],
    transitions: Iterable[tuple[Transition, Selection, Block]],
    targets: Iterable[tuple[Mode, int, Selection]],
) -> TransitionStages:
    """Return the stages of transitions that are taken together, in their order (rule 6).

    `sources` are the modes that are left and `targets` those that are entered, with their depth in
    the chart. The exits of one depth are one stage, and so are its entries and all resets. The
    block of a transition follows its reset. Actions that do nothing are left out.
    """
    exits = _stages_by_depth((depth, Action(mode.exit, when)) for mode, depth, when in sources)
    resets = tuple(
        Action(transition.reset, when, then)
        for transition, when, then in transitions
        if transition.reset or then
    )
    entries = _stages_by_depth((depth, Action(mode.entry, when)) for mode, depth, when in targets)
    return TransitionStages((*reversed(exits), *((resets,) if resets else ())), entries)


def _stages_by_depth(actions: Iterable[tuple[int, Action]]) -> tuple[Stage, ...]:
    """Return one stage for each depth at which something is assigned, the outermost first."""
    stages: dict[int, Stage] = {}
    for depth, action in actions:
        if action.assignments:
            stages[depth] = (*stages.get(depth, ()), action)
    return tuple(stages[depth] for depth in sorted(stages))


def transition_stages(automaton: Automaton, transition: Transition) -> TransitionStages:
    """Return the stages of a transition between modes without nesting."""
    return common_stages(automaton, [(transition, ALWAYS)])


def common_stages(
    automaton: Automaton, transitions: Sequence[tuple[Transition, Selection]]
) -> TransitionStages:
    """Return the stages of transitions of parallel regions without nesting, each if selected."""
    return order_stages(
        ((automaton.source_mode(each), 0, when) for each, when in transitions),
        ((each, when, ()) for each, when in transitions),
        ((automaton.target_mode(each), 0, when) for each, when in transitions),
    )


def initial_stages(modes: Iterable[tuple[int, Mode]]) -> TransitionStages:
    """Return the stages of a start: the entries of the initial modes, each with its depth."""
    return order_stages((), (), ((mode, depth, ALWAYS) for depth, mode in modes))


def stage_reads(stages: Iterable[Stage]) -> list[str]:
    """Return the names that the assignments of stages read, with repetitions."""
    return [
        name
        for stage in stages
        for action in stage
        for formula in action.assignments.values()
        for name in formula.reads
    ]


@dataclass(frozen=True)
class StageBindings:
    """What the stages of transitions read.

    `source` are the bindings of exits and resets, `target` those of entries. `target_equations`
    gives the operations that evaluate the equations of the targets among some names. `refresh` are
    the operations after which `source` and `target` read the states that a stage has stored.
    """

    source: NameBindings
    target: NameBindings
    target_equations: Callable[[list[str]], Iterable[Op]]
    refresh: Block = ()


def bindings_of_target(
    automaton: Automaton, target: Mode, now: NameBindings, known: NameBindings
) -> StageBindings:
    """Return what the stages of a transition to a mode of the chart read.

    Exits and resets read `known`; entries read `now`, which has no equations, and the equations of
    the target as `equation.<name>`.
    """
    prefix = f"{automaton.name} "
    return StageBindings(
        known,
        {**now, **equation_bindings(automaton, "equation.")},
        lambda names: lower_equations(target, dict(now), "equation.", prefix, names),
    )


def bindings_of_targets(
    automaton: Automaton, now: NameBindings, evaluate_equations: Op
) -> StageBindings:
    """Return what the stages of several regions read: `now` and the equations `equation.<name>`.

    `evaluate_equations` evaluates the equations of the active modes; it runs before an entry that
    reads one of them.
    """
    equations = equation_bindings(automaton, "equation.")
    known = {**now, **equations}
    return StageBindings(
        known, known, lambda names: [evaluate_equations] * (not equations.keys().isdisjoint(names))
    )


def lower_transition(
    automaton: Automaton,
    stages: TransitionStages,
    bindings: StageBindings,
    change_modes: Iterable[Op] = (),
) -> Block:
    """Return the operations of transitions that are taken together (rule 6).

    `change_modes` are the operations that make the targets active. The equations that an entry
    reads are evaluated before its stage.
    """
    ops: list[Op] = []
    refresh: Block = ()
    for stage in stages.before:
        ops += (*refresh, *lower_stage(automaton, stage, bindings.source))
        refresh = bindings.refresh
    ops += change_modes
    for stage in stages.after:
        ops += (*refresh, *bindings.target_equations(stage_reads([stage])))
        ops += lower_stage(automaton, stage, bindings.target)
        refresh = bindings.refresh
    return tuple(ops)


def lower_stage(automaton: Automaton, stage: Stage, known: NameBindings) -> Block:
    """Return the operations of one stage: all assignments are evaluated, then all are stored.

    `known` are the names before the stage. A single unconditional assignment to a variable of a
    continuous automaton needs no `work` variable.
    """
    reads = [(each.selection, (*read_stage(automaton, each.assignments, known),)) for each in stage]
    match reads:
        case [(selection, (read,))] if selection == ALWAYS and not automaton.is_sampled:
            (name,) = stage[0].assignments
            return (Assign(storage_of(automaton, name), read.value, read.key),)
    commits = [
        (each.selection, (*commit_stage(automaton, each.assignments), *each.then)) for each in stage
    ]
    return (*select_blocks(reads), *select_blocks(commits))


def select_blocks(blocks: Iterable[tuple[Selection, Block]]) -> Block:
    """Return some blocks, each under its condition; those of one variable's numbers are a Switch.

    Empty blocks are left out.
    """
    ops: list[Op] = []
    cases: dict[str, list[tuple[int, Block]]] = {}
    for (selector, value), block in blocks:
        if block and not selector:
            ops += block
        elif block and isinstance(value, bool):
            ops.append(Branch(Ref(selector), block))
        elif block:
            cases.setdefault(selector, []).append((value, block))
    return (*ops, *(Switch(selector, tuple(own)) for selector, own in cases.items()))


def storage_of(automaton: Automaton, name: str) -> str:
    """Return the variable of a state or discrete variable: `state.<name>` or `discrete.<name>`."""
    return f"{'discrete' if name in automaton.discrete else 'state'}.{name}"


def read_stage(
    automaton: Automaton,
    formulas: Mapping[str, Formula],
    known: NameBindings,
    stage_name: str = "reset",
) -> list[Assign]:
    """Return the first half of a stage: `work.<stage>_<name> = <value>` for each assignment.

    The value is converted to a whole number for an int or an enumeration, else to a real. The key
    path is that of the formula after the name of the automaton.
    """
    found = []
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


def action_variables(automaton: Automaton) -> list[Variable]:
    """Return the `work` variables of all stages, each once.

    They are `work.reset_<name>` for variables that a reset, an entry or an exit assigns, and
    `work.next_<name>` for those that an update assigns.
    """
    found: dict[str, Variable] = {}
    for mode in automaton.all_modes:
        for formulas in mode.jump_assignments:
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
