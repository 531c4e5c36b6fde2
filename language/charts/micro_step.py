"""Micro-steps of a chart: the jump of a tick (rules 3, 6, 7 and 15).

A micro-step selects transitions, resolves conflicts, and commits the selected transitions. Exits
run from the inside out, one stage for each depth; then the resets of all transitions run as one
stage; then entries run from the outside in. Each stage reads one snapshot.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from language.charts.chart_context import (
    IS_FIRST_STEP,
    IS_STEP_LIMIT_REACHED,
    NEVER_LEFT,
    ChartContext,
    entry_flag,
    exit_flag,
    history_ref,
    request_variable,
    selected_variable,
)
from language.charts.entry_blocks import lower_entry_set
from language.charts.exit_blocks import exit_blocks, run_exit_block
from language.charts.transition_selection import selection_blocks, selection_variables
from language.ir.ops import (
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
    RunBlock,
    Store,
    Switch,
    Value,
    add,
    integer,
)
from language.ir.program import LOG_COUNT_VARIABLE, LOG_VARIABLE, Variable, fired_variable
from language.lowering.action_stages import (
    Selection,
    TransitionStages,
    bindings_of_targets,
    initial_stages,
    lower_transition,
    order_stages,
    select_blocks,
)
from language.lowering.event_queue import (
    CURRENT_EVENT,
    HAS_WAITING_EVENT,
    dequeue_event,
    enqueue_event,
    enqueue_input_events,
    event_queue_variables,
)
from language.model.automaton import Mode, Transition
from language.model.declaration import MICRO_STEP_LIMIT_FAULT
from language.model.statechart import ROOT

HAS_NEXT_STEP = Ref("work.is_busy")
"""The variable that another micro-step follows in this tick."""
STEP_COUNT = Ref("work.steps")
"""The number of micro-steps of this tick."""
LOOP_INDEX = "work.turn"
"""The index of the loop over micro-steps."""


def chart_blocks(context: ChartContext, evaluate_equations: Op) -> dict[str, Block]:
    """Return the block `jump` and the blocks that it runs, by name.

    They are those of selection and of exits, `commit`, and `micro_step` if a tick may have several.
    `evaluate_equations` is the operation that evaluates the equations of the active modes.
    """
    blocks = {**selection_blocks(context), **exit_blocks(context)}
    blocks["commit"] = _commit_block(context, evaluate_equations)
    if not context.has_several_micro_steps:
        return {**blocks, "jump": _lower_single_micro_step(context)}
    return {
        **blocks,
        "micro_step": _lower_micro_step(context),
        "jump": _lower_micro_step_loop(context),
    }


def chart_variables(context: ChartContext) -> list[Variable]:
    """Return the variables of a chart; `finalise_program` removes the unused ones.

    They are those of selection and of the event queue, a history and the exit and entry flags of
    each node but the root, and those of the micro-steps and their log.
    """
    found = [*selection_variables(context), *event_queue_variables(context.queue_capacity)]
    for node in context.chart.nodes[ROOT + 1 :]:
        about = f"mode in which `{node.path}` was left"
        found.append(Variable(history_ref(node).name, "whole", about=about))
        for verb, flag in (("left", exit_flag), ("entered", entry_flag)):
            about = f"`{node.path}` is {verb} in this micro-step"
            found.append(Variable(flag(node).name, "truth", about=about))
    found.append(Variable(STEP_COUNT.name, "whole", about="micro-steps of this tick"))
    found.append(Variable(LOOP_INDEX, "whole"))
    found.append(Variable(HAS_NEXT_STEP.name, "truth", about="another micro-step follows"))
    size = _log_size(context)
    about = "transitions of this tick, 0 after those of a micro-step"
    found.append(Variable(LOG_VARIABLE, "whole", size=size, about=about))
    found.append(Variable(LOG_COUNT_VARIABLE, "whole", about="how many entries of log"))
    return found


def clear_histories(context: ChartContext) -> Block:
    """Return the assignments that set the history of each of `history_nodes` to `NEVER_LEFT`."""
    nodes = (context.chart.nodes[index] for index in sorted(context.history_nodes))
    return tuple(Assign(history_ref(node).name, integer(NEVER_LEFT)) for node in nodes)


def initial_chart_stages(context: ChartContext) -> TransitionStages:
    """Return the entries of the initial configuration of a chart as stages."""
    nodes = [(node, context.mode_of(node)) for node in context.chart.initial_configuration()]
    return initial_stages((context.chart.depth(node), mode) for node, mode in nodes if mode)


def _lower_single_micro_step(context: ChartContext) -> Block:
    """Return the block `jump` of a chart with one micro-step in a tick.

    An event that remains in the queue sets a fault bit.
    """
    ops: list[Op] = []
    if context.queue_capacity:
        ops += enqueue_input_events(context.chart)
    ops += [
        RunBlock("select_transitions"),
        *_resolve_conflicts(context),
        Branch(
            _any_selected_condition(context, _selected_variable_name(context)),
            (RunBlock("commit"),),
        ),
    ]
    if context.queue_capacity > 1:
        ops.append(Branch(HAS_WAITING_EVENT, (FaultBit(MICRO_STEP_LIMIT_FAULT),)))
    return tuple(ops)


def _lower_micro_step_loop(context: ChartContext) -> Block:
    """Return the block `jump` of a chart with several micro-steps in a tick.

    The loop ends if no transition is enabled and no event waits, or at the bound.
    """
    ops: list[Op] = [Assign(LOG_COUNT_VARIABLE, integer(0)), Assign(STEP_COUNT.name, integer(0))]
    if context.queue_capacity:
        ops += enqueue_input_events(context.chart)
    ops += [
        Assign(flag.name, Value(value))
        for flag, value in (
            (HAS_NEXT_STEP, True),
            (IS_FIRST_STEP, True),
            (IS_STEP_LIMIT_REACHED, False),
        )
    ]
    turns = context.chart.micro_steps + context.queue_capacity + 2
    return (*ops, Loop(turns, LOOP_INDEX, (Branch(HAS_NEXT_STEP, (RunBlock("micro_step"),)),)))


def _lower_micro_step(context: ChartContext) -> Block:
    """Return the block `micro_step`: commit the selection, or take the next event, or end the tick.

    If the bound is reached and work remains, a fault bit is set.
    """
    fired = _any_selected_condition(context, _selected_variable_name(context))
    over: Block = (FaultBit(MICRO_STEP_LIMIT_FAULT), Assign(HAS_NEXT_STEP.name, Value(False)))
    done: list[Op] = [
        RunBlock("commit"),
        _append_log_entry(context, integer(0)),
        Assign(STEP_COUNT.name, add(STEP_COUNT, integer(1))),
    ]
    if context.queue_capacity:
        done.append(Assign(CURRENT_EVENT.name, integer(0)))
    reached = Compare("==", STEP_COUNT, integer(context.chart.micro_steps))
    done.append(Assign(IS_STEP_LIMIT_REACHED.name, reached))
    end: Block = (Assign(HAS_NEXT_STEP.name, Value(False)),)
    if context.queue_capacity:
        late: Block = (Branch(IS_STEP_LIMIT_REACHED, over, dequeue_event()),)
        end = (Branch(HAS_WAITING_EVENT, late, end),)
    ops: list[Op] = [RunBlock("select_transitions"), *_resolve_conflicts(context)]
    ops.append(Branch(fired, (Branch(IS_STEP_LIMIT_REACHED, over, tuple(done)),), end))
    return (*ops, Assign(IS_FIRST_STEP.name, Value(False)))


def _resolve_conflicts(context: ChartContext) -> Block:
    """Return the operation that resolves conflicts between regions; none for a single region."""
    return (RunBlock("resolve_conflicts"),) if len(context.chart.regions) > 1 else ()


def _selected_variable_name(context: ChartContext) -> Callable[[str], str]:
    """Return the function from a region to the variable of its selected transition.

    A single region has no conflicts, so its request is its selection.
    """
    return selected_variable if len(context.chart.regions) > 1 else request_variable


def _any_selected_condition(context: ChartContext, variable_of: Callable[[str], str]) -> Expr:
    """Return the condition that a region has selected a transition."""
    found: Expr | None = None
    for region in context.chart.regions:
        here = Compare("!=", Ref(variable_of(region.region)), integer(0))
        found = here if found is None else Binary("or", found, here)
    assert found is not None
    return found


def _commit_block(context: ChartContext, evaluate_equations: Op) -> Block:
    """Return the operations of the selected transitions: exits, resets, entries, equations.

    The flags of the nodes that are left and entered select their actions.
    """
    nodes = context.chart.nodes

    def flagged(flags: Mapping[int, str]) -> list[tuple[Mode, int, Selection]]:
        """Return the modes of nodes with a flag, each with its depth and its flag."""
        modes = ((context.mode_of(nodes[index]), index, flag) for index, flag in flags.items())
        return [(m, context.chart.depth(nodes[k]), (flag, True)) for m, k, flag in modes if m]

    stages = order_stages(
        flagged(context.exit_flags),
        (
            (transition, _selection(context, transition), _raise_events(context, transition))
            for transition, _ in context.all_transitions
        ),
        flagged(context.entry_flags),
    )
    read = bindings_of_targets(context.automaton, context.base_bindings, evaluate_equations)
    flags = (*context.exit_flags.values(), *context.entry_flags.values())
    return (
        *(Assign(flag, Value(False)) for flag in flags),
        *_log_and_exit(context),
        *lower_transition(context.automaton, stages, read, _enter_targets(context)),
        evaluate_equations,
    )


def _raise_events(context: ChartContext, transition: Transition) -> Block:
    """Return the operations that enqueue the events which a transition raises."""
    ops: list[Op] = []
    for name in transition.raises:
        ops += enqueue_event(context.chart, name, context.queue_capacity)
    return tuple(ops)


def _selection(context: ChartContext, transition: Transition) -> Selection:
    """Return the variable and the number that select a transition."""
    variable = _selected_variable_name(context)(transition.region)
    return variable, context.info_of(transition).number


def _log_and_exit(context: ChartContext) -> Block:
    """Return the operations that record the selected transitions and leave their sources."""
    ops: list[Op] = []
    for region in context.chart.regions:
        chosen = Ref(_selected_variable_name(context)(region.region))
        cases = []
        for transition, chart_transition in context.transitions_in(region.region):
            if chart_transition.domain is not None:
                block = (run_exit_block(context.chart.nodes[chart_transition.domain]),)
                cases.append((context.info_of(transition).number, block))
        if not context.transitions_in(region.region):
            continue
        log: Block = (Assign(fired_variable(region.region), chosen),)
        if context.has_several_micro_steps:
            log = (*log, _append_log_entry(context, chosen))
        ops.append(Branch(Compare("!=", chosen, integer(0)), log))
        if cases:
            ops.append(Switch(chosen.name, tuple(cases)))
    return tuple(ops)


def _log_size(context: ChartContext) -> int:
    """Return the largest number of log entries in a tick.

    Each micro-step has one entry for each region and an end mark.
    """
    return context.chart.micro_steps * (len(context.chart.regions) + 1)


def _append_log_entry(context: ChartContext, entry: Expr) -> Op:
    """Return the operation that appends an entry to the log.

    There is always room; the test makes this visible to tools that analyse value ranges.
    """
    written = (
        Store(LOG_VARIABLE, Ref(LOG_COUNT_VARIABLE), entry),
        Assign(LOG_COUNT_VARIABLE, add(Ref(LOG_COUNT_VARIABLE), integer(1))),
    )
    return Branch(Compare("<", Ref(LOG_COUNT_VARIABLE), integer(_log_size(context))), written)


def _enter_targets(context: ChartContext) -> Block:
    """Return the operations that activate the entry sets of the selected transitions."""
    return select_blocks(
        (_selection(context, transition), lower_entry_set(context, transition, chart_transition))
        for transition, chart_transition in context.all_transitions
    )
