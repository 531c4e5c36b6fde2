"""Check of charts: targets, histories, completions, priorities and writers (rules 3 and 14)."""

from __future__ import annotations

from collections.abc import Iterator, Set

from language.expressions.syntax_tree import Name, walk
from language.lowering.chart_activity import may_complete
from language.lowering.program_builder import INACTIVE
from language.model.automaton import Automaton, Mode, Transition
from language.model.statechart import ROOT, Chart, ChartNode
from language.text.diagnostic import Problems, Span


def check_chart(automaton: Automaton, problems: Problems) -> None:
    """Report invalid transitions, modes and regions of a chart; other automata have no problem.

    Errors are a continuous chart, variables that two parallel regions assign (rule 14), sibling
    regions of equal priority that a transition leaves both (rule 3), transitions of a final mode,
    equations or flow of a region inside a mode, a rewind, a completion of a mode without a final
    mode, a history of a mode without modes, and `memory: continue` without wait counters.

    Warnings are a transition to a history from inside its mode, and a guard that reads an input
    event.
    """
    chart = automaton.statechart
    if chart is None:
        return
    if not automaton.is_sampled:
        label = "modes inside modes, events and micro-steps belong to a sampled automaton"
        problems.error("form", automaton.span, label, "give it a `period`")
    _check_writers(automaton, chart, problems)
    _check_region_priorities(automaton, chart, problems)
    for node in chart.nodes[ROOT + 1 :]:
        mode = automaton.modes_by_key.get(node.mode_key)
        if mode:
            _check_inner(chart, node, mode, problems)
            for transition in mode.transitions:
                _check_guard(chart, transition, problems)
                _check_transition(chart, node, transition, problems)
                _check_memory(automaton, chart, transition, problems)


def unreachable_chart_modes(
    automaton: Automaton, chart: Chart, dead_transitions: Set[str]
) -> list[Mode]:
    """Return the modes of a chart that no transition outside of `dead_transitions` leads to.

    `dead_transitions` are key paths. Reachable are the initial modes, the fault mode, and what
    transitions of reachable modes enter, with ancestors and sibling regions; guards are not
    examined, and a history counts as all that it may enter. The result is in the order of the nodes
    and includes superstates.
    """
    reachable = {node.index for node in chart.initial_configuration()}
    if automaton.fault_mode:
        reachable.update(
            _entry_set(chart, [n.index for n in chart.nodes if n.path == automaton.fault_mode])
        )
    while True:
        targets: list[int] = []
        for node in chart.nodes[ROOT + 1 :]:
            mode = automaton.modes_by_key.get(node.mode_key)
            if node.index in reachable and mode:
                transitions = (
                    transition
                    for transition in mode.transitions
                    if transition.key not in dead_transitions
                )
                targets += [
                    t
                    for transition in transitions
                    for t in chart.transitions[transition.key].targets
                ]
        more = reachable | _entry_set(chart, targets)
        if more == reachable:
            break
        reachable = more
    nodes = (node for node in chart.nodes if node.mode_key and node.index not in reachable)
    return [automaton.modes_by_key[node.mode_key] for node in nodes]


def _entry_set(chart: Chart, targets: list[int]) -> set[int]:
    """Return the indices of the nodes that are active after some nodes are entered.

    These are the initial configurations of the nodes, their ancestors, and the other regions of
    parallel ancestors.
    """
    entered: set[int] = set()
    for target in targets:
        node = chart.nodes[target]
        entered.update(inner.index for inner in chart.entry_set(node, ()))
        for outer in chart.ancestors(node):
            entered.add(outer.index)
            if outer.kind == "parallel":
                entered.update(inner.index for inner in chart.entry_set(outer, [target]))
    return entered


def _check_inner(chart: Chart, node: ChartNode, mode: Mode, problems: Problems) -> None:
    """Report transitions of a final mode, a reserved name, and formulas of an inner region.

    A region inside a mode has no equations and no flow.
    """
    if node.is_final and mode.transitions:
        label = f"`{node.path}` is final: no transition leaves it"
        problems.error("form", mode.transitions[0].span, label)
    if node.name == INACTIVE and node.region != node.path:
        label = f"`{INACTIVE}` is what a region is in while its mode is left"
        problems.error("name", mode.span, label)
    root = list(chart.ancestors(node))[-1]
    if node.region == root.region:
        return
    for what, written in (("equations", mode.equations), ("flow", mode.flow)):
        for name in written:
            label = f"`{name}`: a region inside a mode has no `{what}`, for it is not always active"
            hint = "give a discrete variable its value in `update`, `entry` or `reset`"
            problems.error("form", mode.span, label, hint)


def _check_transition(
    chart: Chart, node: ChartNode, transition: Transition, problems: Problems
) -> None:
    """Report a rewind, a completion without final mode, and a history of a mode without modes."""
    if transition.rewind:
        label = "a transition of a chart does not rewind"
        problems.error("form", transition.span, label)
    if transition.is_completion and not may_complete(chart, node):
        label = f"`{node.path}` never comes to its end: there is no final mode in it"
        hint = "`when: true` for a transition that is always enabled, else a guard"
        problems.error("missing", transition.span, label, hint)
    _check_history(chart, node, transition, problems)
    if transition.history:
        for index in chart.transitions[transition.key].targets:
            target = chart.nodes[index]
            if target.kind not in ("compound", "parallel"):
                label = f"`{target.path}` has no modes inside: there is no history of it"
                problems.error("form", transition.span, label)


def _check_history(
    chart: Chart, node: ChartNode, transition: Transition, problems: Problems
) -> None:
    """Warn of a transition to a history from inside of its mode.

    The history stores the last configuration before the mode was left, and this transition does not
    leave it.
    """
    chart_transition = chart.transitions[transition.key]
    for index in chart_transition.targets:
        target = chart.nodes[index]
        outer = chart.nodes[target.parent]
        stays = (
            chart_transition.domain is not None
            and outer.contains(chart_transition.domain)
            and outer.contains(node.index)
        )
        if target.kind == "history" and stays and target.initial:
            label = f"`{target.name}` is what `{outer.path}` was left in, which this does not leave"
            back = chart.nodes[target.initial[0]]
            hint = "a history is entered from outside of its mode"
            if back.kind in ("compound", "parallel"):
                hint = f"to go back to where `{back.name}` was left: `{{to: {back.name}, "
                hint += f"history: {target.history}}}`"
            problems.warning("form", transition.span, label, hint)


def _check_region_priorities(automaton: Automaton, chart: Chart, problems: Problems) -> None:
    """Report sibling regions of equal priority in which a transition can leave both (rule 3)."""
    for parallel in chart.nodes[ROOT + 1 :]:
        regions = chart.child_regions(parallel)
        for position, later in enumerate(regions):
            for earlier in regions[:position]:
                if later.priority == earlier.priority and _can_leave_both(chart, earlier, later):
                    label = f"a transition in `{earlier.path}` or `{later.path}` leaves both"
                    hint = "give them different priorities, like `priority: 1`: the smallest goes "
                    hint += "first where each has a transition"
                    place = automaton.region(later.region).span
                    problems.error("priority", place, label, hint)


def _can_leave_both(chart: Chart, left: ChartNode, right: ChartNode) -> bool:
    """Return whether a transition in one of two sibling regions can leave both.

    Both regions need a transition with a domain; one of these domains has to contain the parallel
    mode.
    """
    transitions = [
        transition for transition in chart.transitions.values() if transition.domain is not None
    ]
    from_left = [
        transition.domain for transition in transitions if left.contains(transition.source)
    ]
    from_right = [
        transition.domain for transition in transitions if right.contains(transition.source)
    ]
    if not from_left or not from_right:
        return False
    outer = left.parent
    return any(domain is not None and domain < outer for domain in (*from_left, *from_right))


def _check_guard(chart: Chart, transition: Transition, problems: Problems) -> None:
    """Warn of a guard that reads an input event as a condition.

    Such a guard holds in every micro-step of a tick.
    """
    for part in walk(transition.when.tree):
        signal = chart.events.get(part.path) if isinstance(part, Name) else None
        if signal and signal.is_input:
            label = f"`{signal.name}` is an event"
            hint = f"write `event: {signal.name}` beside `when`; as a guard it holds in every "
            hint += "micro-step of a tick"
            problems.warning("form", part.span, label, hint)


def _check_memory(
    automaton: Automaton, chart: Chart, transition: Transition, problems: Problems
) -> None:
    """Report `memory: continue` on a transition that enters no mode with wait counters."""
    targets = chart.transitions[transition.key].targets
    reached = [n for n in chart.nodes if any(chart.are_nested(n.index, t) for t in targets)]
    modes = [automaton.modes_by_key[node.mode_key] for node in reached if node.mode_key]
    has_counters = any(each.wait for mode in modes for each in mode.transitions)
    if transition.memory == "continue" and not has_counters:
        label = "`memory: continue` keeps wait counters: nothing that is entered has one"
        hint = "states belong to the automaton and keep their values anyway"
        problems.error("form", transition.span, label, hint)


def _check_writers(automaton: Automaton, chart: Chart, problems: Problems) -> None:
    """Report variables that two parallel regions assign (rule 14).

    Nested regions may assign the same variable, but not both while their modes stay active.
    """
    writers: dict[str, list[tuple[str, bool]]] = {}
    for mode in automaton.all_modes:
        for name, span, stays in _assigned_names(chart, mode):
            known = writers.setdefault(name, [])
            for region, stayed in known:
                if _are_parallel(chart, region, mode.region) or (
                    region != mode.region and stays and stayed
                ):
                    here = f"in region `{region}` and in region `{mode.region}`"
                    label = f"`{name}` has an assignment {here}"
                    hint = "parallel regions write disjoint variables"
                    problems.error("writer", span, label, hint)
                    break
            if (mode.region, stays) not in known:
                known.append((mode.region, stays))


def _assigned_names(chart: Chart, mode: Mode) -> Iterator[tuple[str, Span, bool]]:
    """Yield each assigned name of a mode with its place and whether the mode stays active."""
    for formulas in (mode.entry, mode.exit):
        yield from ((name, formula.span, False) for name, formula in formulas.items())
    yield from ((name, formula.span, True) for name, formula in mode.update.items())
    for transition in mode.transitions:
        stays = chart.transitions[transition.key].domain is None
        yield from ((name, formula.span, stays) for name, formula in transition.reset.items())


def _are_parallel(chart: Chart, left: str, right: str) -> bool:
    """Return whether two regions are parallel, that is neither contains the other."""
    a, b = chart.region_node(left), chart.region_node(right)
    return not chart.are_nested(a.index, b.index)
