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
from language.lowering.action_stages import commit_stage, lower_entry, read_stage
from language.lowering.event_queue import (
    CURRENT_EVENT,
    HAS_WAITING_EVENT,
    dequeue_event,
    enqueue_event,
    enqueue_input_events,
    event_queue_variables,
)
from language.lowering.expressions import names_read
from language.model.automaton import Automaton
from language.model.declaration import MICRO_STEP_LIMIT_FAULT, Formula
from language.model.statechart import ROOT, Chart, ChartNode

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


def lower_initial_entries(automaton: Automaton, chart: Chart, now: Mapping[str, Expr]) -> Block:
    """Return the entry actions of the initial configuration, one stage for each depth.

    Outer nodes come first. Each stage evaluates the equations of the initial mode that it reads.
    `now` are the bindings without equations.
    """
    active = [
        (chart.depth(node), automaton.modes_by_key.get(node.mode_key))
        for node in chart.initial_configuration()
    ]
    initial = automaton.modes[automaton.initial]
    ops: list[Op] = []
    for depth in sorted({depth for depth, _ in active}):
        written = {
            name: formula
            for own, mode in active
            if own == depth and mode
            for name, formula in mode.entry.items()
        }
        ops += lower_entry(automaton, initial, written, now)
    return tuple(ops)


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
    """Return the operations of the selected transitions: exits, resets, entries, equations."""
    ops: list[Op] = []
    leaving = [n for n in context.chart.nodes if (m := context.mode_of(n)) and m.exit]
    coming = [n for n in context.chart.nodes if (m := context.mode_of(n)) and m.entry]
    ops += [Assign(exit_flag(node).name, Value(False)) for node in leaving]
    ops += [Assign(entry_flag(node).name, Value(False)) for node in coming]
    ops += _log_and_exit(context)
    for depth in sorted({context.chart.depth(node) for node in leaving}, reverse=True):
        nodes = [node for node in leaving if context.chart.depth(node) == depth]
        ops += _lower_flagged_stage(
            context,
            [(exit_flag(n), context.automaton.modes_by_key[n.mode_key].exit) for n in nodes],
        )
    ops += _lower_resets(context)
    ops += _enter_targets(context)
    ops += _lower_entries(context, coming, evaluate_equations)
    return (*ops, evaluate_equations)


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


def _lower_flagged_stage(
    context: ChartContext, flagged: list[tuple[Ref, Mapping[str, Formula]]]
) -> Block:
    """Return one stage of the nodes whose flag is set: all read, then all commit."""
    automaton = context.automaton
    reads = [
        Branch(flag, tuple(read_stage(automaton, written, context.bindings)))
        for flag, written in flagged
    ]
    commits = [Branch(flag, tuple(commit_stage(automaton, written))) for flag, written in flagged]
    return (*reads, *commits)


def _lower_resets(context: ChartContext) -> Block:
    """Return the resets of all selected transitions as one stage, and the events they raise."""
    automaton = context.automaton
    reads: list[Op] = []
    commits: list[Op] = []
    for region in context.chart.regions:
        read, commit = [], []
        for transition, _ in context.transitions_in(region.region):
            number = context.info_of(transition).number
            written = transition.reset
            if written:
                read.append((number, tuple(read_stage(automaton, written, context.bindings))))
            ops = tuple(commit_stage(automaton, written))
            for name in transition.raises:
                ops = (*ops, *enqueue_event(context.chart, name, context.queue_capacity))
            if ops:
                commit.append((number, ops))
        chosen = _selected_variable_name(context)(region.region)
        reads += [Switch(chosen, tuple(read))] if read else []
        commits += [Switch(chosen, tuple(commit))] if commit else []
    return (*reads, *commits)


def _enter_targets(context: ChartContext) -> Block:
    """Return the operations that activate the entry sets of the selected transitions."""
    ops: list[Op] = []
    for region in context.chart.regions:
        cases = []
        for transition, chart_transition in context.transitions_in(region.region):
            block = lower_entry_set(context, transition, chart_transition)
            if block:
                cases.append((context.info_of(transition).number, block))
        if cases:
            ops.append(Switch(_selected_variable_name(context)(region.region), tuple(cases)))
    return tuple(ops)


def _lower_entries(
    context: ChartContext, entered_nodes: list[ChartNode], evaluate_equations: Op
) -> Block:
    """Return the entry actions from the outside in, one stage for each depth.

    The equations are evaluated before a stage that reads one.
    """
    ops: list[Op] = []
    automaton = context.automaton
    for depth in sorted({context.chart.depth(node) for node in entered_nodes}):
        nodes = [node for node in entered_nodes if context.chart.depth(node) == depth]
        written = [automaton.modes_by_key[node.mode_key].entry for node in nodes]
        reads = names_read(formula.tree for each in written for formula in each.values())
        if any(name in context.bindings and name not in context.base_bindings for name in reads):
            ops.append(evaluate_equations)
        ops += _lower_flagged_stage(
            context, list(zip(map(entry_flag, nodes), written, strict=True))
        )
    return tuple(ops)
