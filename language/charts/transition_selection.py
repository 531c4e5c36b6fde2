"""Selection of transitions in a chart and resolution of conflicts between regions (rules 3 and 15).

Each region requests the enabled transition of its outermost or innermost active mode, by `order`.
The requests are then resolved from the innermost regions on (SCXML 2015,
`removeConflictingTransitions`). Of two transitions that leave the same mode, the one from further
inside is taken, otherwise the one that is resolved first. Sibling regions are resolved in the order
of their `priority`.
"""

from __future__ import annotations

from collections.abc import Sequence

from language.charts.chart_context import (
    IS_FIRST_STEP,
    IS_STEP_LIMIT_REACHED,
    ChartContext,
    request_variable,
    selected_variable,
    to_identifier,
)
from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Compare,
    Expr,
    Op,
    Ref,
    RunBlock,
    Switch,
    Value,
    integer,
)
from language.ir.program import Variable, mode_variable
from language.ir.root_region import CHART
from language.lowering.chart_activity import is_complete
from language.lowering.edge_detection import edge_detectors_by_mode
from language.lowering.event_queue import event_condition
from language.lowering.fault_mode import FAULT_PRIORITY
from language.lowering.range_saturation import FAULT_HAPPENED
from language.lowering.transition_choice import (
    SampledChoice,
    choose_by_priority,
    lower_sampled_choice,
)
from language.model.automaton import Mode, Transition
from language.model.statechart import ChartNode

EMPTY_SPAN = (1, 0)
"""The first and the last index of an empty span of nodes."""


def selection_blocks(context: ChartContext) -> dict[str, Block]:
    """Return the blocks that count waits, select transitions and resolve conflicts, by name.

    They are `count_<node>` (waits and edges) and `choose_<node>` (request by priority) of each node
    with transitions, `select_transitions` and, with several regions, `resolve_conflicts` and
    `resolve_request_<region>`. A node without waits and edges has no `count_<node>`.
    """
    blocks: dict[str, Block] = {}
    for node in context.chart.nodes:
        mode = context.mode_of(node)
        if mode and mode.transitions:
            counts, chosen = _timers_and_choice(context, node, mode)
            if counts:
                blocks[f"count_{to_identifier(node.path)}"] = counts
            blocks[f"choose_{to_identifier(node.path)}"] = chosen
    regions = context.chart.regions
    ops: list[Op] = [Assign(request_variable(region.region), integer(0)) for region in regions]
    for region in regions:
        ops += _request_in_region(context, region, blocks)
    blocks["select_transitions"] = tuple(ops)
    if len(regions) > 1:
        blocks.update(_conflict_resolution_blocks(context))
    return blocks


def selection_variables(context: ChartContext) -> list[Variable]:
    """Return the variables of the selection blocks, with or without conflicts.

    Each region has its request, its selection, the first and last node that its request leaves, and
    whether its request is resolved; the last three variables are common to all regions.
    """
    found = []
    for region in context.chart.regions:
        name = region.region
        found += [
            Variable(
                request_variable(name),
                "whole",
                about="transition that the region requests, 0: none",
            ),
            Variable(selected_variable(name), "whole", about="transition that it takes, 0: none"),
            Variable(_span_first(region), "whole", about="first node that its request leaves"),
            Variable(_span_last(region), "whole", about="last node that its request leaves"),
            Variable(_is_resolved_variable(region), "truth", about="its request is resolved"),
        ]
    return [
        *found,
        Variable("work.is_granted", "truth", about="no selected transition leaves the same node"),
        Variable(IS_FIRST_STEP.name, "truth", about="this is the first micro-step of the tick"),
        Variable(IS_STEP_LIMIT_REACHED.name, "truth", about="no further micro-step is allowed"),
    ]


def _timers_and_choice(context: ChartContext, node: ChartNode, mode: Mode) -> tuple[Block, Block]:
    """Return the counters and edges of a mode's transitions, and the choice of a request."""
    choice = choice_of_node(context, node, mode)
    take: dict[int, Block] = {}
    for k, info in enumerate(map(context.info_of, mode.transitions)):
        take[k] = (Assign(request_variable(node.region), integer(info.number), info.key),)
    chosen = choose_by_priority(mode, choice.enabled, take)
    return _count_waits(context, mode, choice), chosen


def choice_of_node(context: ChartContext, node: ChartNode, mode: Mode) -> SampledChoice:
    """Return the guards and waits of the transitions that leave a node, `mode` being its mode."""
    return lower_sampled_choice(
        context.automaton,
        mode,
        context.bindings,
        [context.info_of(transition) for transition in mode.transitions],
        lambda transition, guard: _enabled_condition(context, node, transition, guard),
    )


def _count_waits(context: ChartContext, mode: Mode, choice: SampledChoice) -> Block:
    """Return the operations that count waits once a tick (rule 4c).

    A wait that begins in a later micro-step starts at 1 there, and a false guard clears it.
    """
    edges, counts = choice.edges, choice.counts
    if not context.has_several_micro_steps or not (edges or counts):
        return (*edges, *counts)
    found = edge_detectors_by_mode(context.automaton).get(mode.key, ())
    over = tuple(Assign(f"work.edge_{edge.number}", Value(False)) for edge in found)
    return (
        Branch(
            IS_FIRST_STEP,
            (*edges, *counts),
            (Branch(IS_STEP_LIMIT_REACHED, over, (*edges, *choice.restarts)),),
        ),
    )


def _enabled_condition(
    context: ChartContext, node: ChartNode, transition: Transition, guard: Expr
) -> Expr:
    """Return the condition of a transition: completion, guard, or event and guard."""
    event = event_condition(context.chart, transition, context.queue_capacity)
    if transition.is_completion:
        return is_complete(context.chart, node, "memory.mode")
    if event is None:
        return guard
    return event if guard == Value(True) else Binary("and", event, guard)


def _request_in_region(context: ChartContext, region: ChartNode, blocks: dict[str, Block]) -> Block:
    """Return the operations that set the request of a region, by its active leaf.

    A region that a pending fault leaves makes no request then.
    """
    cases = []
    for leaf in context.chart.leaves(region.region):
        assert leaf.number is not None
        ops = _request_in_leaf(context, leaf, blocks)
        if ops:
            cases.append((leaf.number, ops))
    found: Block = (Switch(mode_variable("memory.mode", region.region), tuple(cases)),)
    if not cases:
        return ()
    return (
        (Branch(Ref(FAULT_HAPPENED), (), found),) if _is_left_by_fault(context, region) else found
    )


def _is_left_by_fault(context: ChartContext, region: ChartNode) -> bool:
    """Return whether the transition into the fault mode leaves a region."""
    holding = [leaf for leaf in context.chart.leaves(CHART) if leaf.contains(region.index)]
    return any(
        transition.priority == FAULT_PRIORITY
        for leaf in holding
        for transition in context.transitions_of(leaf)
    )


def _request_in_leaf(context: ChartContext, leaf: ChartNode, blocks: dict[str, Block]) -> Block:
    """Return the operations that set the request while a leaf is active.

    They count the waits of the leaf and its ancestors, then try them in the declared order.
    """
    chain = [n for n in context.chart.region_ancestors(leaf) if context.transitions_of(n)]
    names = [to_identifier(node.path) for node in chain]
    ops: list[Op] = [RunBlock(f"count_{name}") for name in names if f"count_{name}" in blocks]
    order = names if context.chart.order == "inner_first" else names[::-1]
    chosen: Block = ()
    none = Compare("==", Ref(request_variable(leaf.region)), integer(0))
    for name in reversed(order):
        more: Block = (Branch(none, chosen),) if chosen else ()
        chosen = (RunBlock(f"choose_{name}"), *more)
    fault = next((w for w in context.transitions_of(leaf) if w.priority == FAULT_PRIORITY), None)
    if fault and context.chart.order == "outer_first" and len(names) > 1:
        at_once = Assign(request_variable(leaf.region), integer(context.info_of(fault).number))
        chosen = (Branch(Ref(FAULT_HAPPENED), (at_once,), chosen),)
    return (*ops, *chosen)


def _conflict_resolution_blocks(context: ChartContext) -> dict[str, Block]:
    """Return the block `resolve_conflicts` and, for each region, `resolve_request_<region>`.

    They turn requests into selections.
    """
    regions = context.chart.regions
    pairs = {region.index: _conflicting_regions(context, region) for region in regions}
    conflicts = any(pairs.values())
    blocks: dict[str, Block] = {}
    ops: list[Op] = []
    for region in regions:
        ops.append(Assign(selected_variable(region.region), integer(0)))
        ops.append(Assign(_is_resolved_variable(region), Value(False)))
        if conflicts:
            ops += _set_exit_span(context, region)
        blocks[f"resolve_request_{to_identifier(region.region)}"] = _resolve_request(
            context, region, pairs[region.index]
        )
    for region in regions:
        ops += _resolve_in_leaf(context, region)
    blocks["resolve_conflicts"] = tuple(ops)
    return blocks


def _conflicting_regions(context: ChartContext, region: ChartNode) -> list[ChartNode]:
    """Return the other regions with a transition that may leave nodes that this region leaves."""
    chart = context.chart
    own = chart.exited_domains(
        chart_transition for _, chart_transition in context.transitions_in(region.region)
    )
    found = []
    for other in chart.regions:
        theirs = chart.exited_domains(
            chart_transition for _, chart_transition in context.transitions_in(other.region)
        )
        if other is not region and any(chart.are_nested(a, b) for a in own for b in theirs):
            found.append(other)
    return found


def _set_exit_span(context: ChartContext, region: ChartNode) -> Block:
    """Return the operations that set the first and last node which a region's request leaves."""
    cases = []
    for transition, chart_transition in context.transitions_in(region.region):
        low, high = EMPTY_SPAN
        if chart_transition.domain is not None:
            low, high = (
                chart_transition.domain,
                context.chart.nodes[chart_transition.domain].last_descendant,
            )
        ops = (Assign(_span_first(region), integer(low)), Assign(_span_last(region), integer(high)))
        cases.append((context.info_of(transition).number, ops))
    return (
        Assign(_span_first(region), integer(EMPTY_SPAN[0])),
        Assign(_span_last(region), integer(EMPTY_SPAN[1])),
        Switch(request_variable(region.region), tuple(cases)),
    )


def _resolve_request(
    context: ChartContext, region: ChartNode, conflicting: Sequence[ChartNode]
) -> Block:
    """Return the operations that take the request of a region unless it conflicts.

    A conflict with a region around this one removes that region's selection; any other conflict
    rejects the request.
    """
    is_granted = Ref("work.is_granted")
    take: list[Op] = [
        Assign(selected_variable(region.region), Ref(request_variable(region.region)))
    ]
    ops: list[Op] = [Assign(_is_resolved_variable(region), Value(True))]
    if conflicting:
        ops.append(Assign(is_granted.name, Value(True)))
    for other in conflicting:
        is_taken = Compare("!=", Ref(selected_variable(other.region)), integer(0))
        clash = Binary("and", is_taken, _spans_overlap(region, other))
        if context.chart.is_region_inside(region, other):
            take.insert(0, Branch(clash, (Assign(selected_variable(other.region), integer(0)),)))
        else:
            ops.append(Branch(clash, (Assign(is_granted.name, Value(False)),)))
    return (*ops, Branch(is_granted, tuple(take))) if conflicting else (*ops, *take)


def _spans_overlap(left: ChartNode, right: ChartNode) -> Expr:
    """Return the condition that two nonempty spans of nodes overlap."""

    def begins(inner: ChartNode, outer: ChartNode) -> Expr:
        """Return the condition that the span of `inner` begins in that of `outer`."""
        low = Ref(_span_first(inner))
        after = Compare("<=", Ref(_span_first(outer)), low)
        return Binary("and", after, Compare("<=", low, Ref(_span_last(outer))))

    some = Binary(
        "and",
        Compare("<=", Ref(_span_first(left)), Ref(_span_last(left))),
        Compare("<=", Ref(_span_first(right)), Ref(_span_last(right))),
    )
    return Binary("and", some, Binary("or", begins(left, right), begins(right, left)))


def _resolve_in_leaf(context: ChartContext, region: ChartNode) -> Block:
    """Return the operations that resolve a region whose active leaf has no regions.

    They resolve the first request of the region and those around it, by `order`.
    """
    chart = context.chart
    leaves = [leaf for leaf in chart.leaves(region.region) if leaf.kind == "atomic"]
    enclosing = [region]
    while (outer := chart.parent_region(enclosing[-1])) is not None:
        enclosing.append(outer)
    if chart.order == "outer_first":
        enclosing.reverse()
    ops: Block = ()
    for each in reversed(enclosing):
        if not context.transitions_in(each.region):
            continue
        fresh = Branch(
            Ref(_is_resolved_variable(each)),
            (),
            (RunBlock(f"resolve_request_{to_identifier(each.region)}"),),
        )
        ops = (
            Branch(Compare("!=", Ref(request_variable(each.region)), integer(0)), (fresh,), ops),
        )
    cases = tuple((leaf.number, ops) for leaf in leaves if leaf.number is not None)
    if not ops or not cases:
        return ()
    return (Switch(mode_variable("memory.mode", region.region), cases),)


def _span_first(region: ChartNode) -> str:
    """Return the variable of the first node that the request of a region leaves."""
    return f"work.span_first_{to_identifier(region.region)}"


def _span_last(region: ChartNode) -> str:
    """Return the variable of the last node that the request of a region leaves."""
    return f"work.span_last_{to_identifier(region.region)}"


def _is_resolved_variable(region: ChartNode) -> str:
    """Return the variable that the request of a region is resolved."""
    return f"work.is_resolved_{to_identifier(region.region)}"
