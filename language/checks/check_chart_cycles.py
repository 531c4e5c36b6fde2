"""Chart cycle check: finds transitions that fire in every micro-step of a tick (rule 7).

A cycle is reported only if it is certain: all variables that the guards read are constant within a
tick, and no other transition of the active modes can fire between.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from language.checks.check_instant_cycles import MAX_CYCLES, Cycle, format_cycle, simple_cycles
from language.expressions.syntax_tree import TIME_FUNCTIONS, FunctionCall, walk
from language.ir.ops import Expr, Ref, Unary
from language.lowering.constants import wait_seconds
from language.model.automaton import Automaton, Transition
from language.model.statechart import ROOT, Chart, ChartNode
from language.model.transition_precedence import node_of
from language.smt.query_engine import QueryEngine, Witness
from language.smt.symbolic_environment import TIME_IN_MODE, GuardSnapshot, SymbolicPath
from language.text.diagnostic import Problems, SpecError

CHANGED_PREFIX = "memory.changed"
"""Variables that are true in the first micro-step of a tick only.

An endless cycle does not need them.
"""
DELAYED_PREFIXES = ("memory.previous", "memory.delay")
"""Variables of earlier ticks: they can be inconsistent with the assumption that nothing changed."""
AGE_PREFIXES = (TIME_IN_MODE, "memory.every")
"""Variables that restart when a mode is entered."""
CYCLE_HINT = "let one of them wait, or its guard exclude the one before"
"""Hint for a cycle without events."""
EVENT_HINT = "let one of them raise no event"
"""Hint for a cycle with events."""


def check_chart_cycles(automaton: Automaton, query_engine: QueryEngine, problems: Problems) -> None:
    """Warn of cycles of chart transitions that use up all micro-steps of a tick (rule 7).

    A chart with one micro-step has none, an automaton without a chart neither. At most MAX_CYCLES
    candidate cycles of at most MAX_CYCLE_LENGTH transitions are examined. A cycle is reported, at
    its last transition, only with values at which all its guards and no competing guard hold and
    nothing that they read changes within a tick; its events must be raised by the cycle itself.
    """
    chart = automaton.statechart
    if chart is None or chart.micro_steps < 2:
        return
    transitions = {each.key: each for each in automaton.all_transitions}
    after = {
        key: list(_possible_successors(automaton, chart, each)) for key, each in transitions.items()
    }
    for members in islice(simple_cycles(after), MAX_CYCLES):
        cycle = tuple(transitions[key] for key in members)
        witness = _find_endless_witness(automaton, chart, cycle, query_engine)
        if witness:
            label = "this fires in every micro-step of a tick"
            label += f": {format_cycle(cycle)}" if cycle[0].targets else ""
            hint = EVENT_HINT if cycle[0].events else CYCLE_HINT
            hint = hint if cycle[0].targets else _self_loop_hint(automaton, cycle[0])
            problems.warning("cycle", cycle[-1].span, label, witness.hint_prefix + hint)


def _self_loop_hint(automaton: Automaton, transition: Transition) -> str:
    """Return the hint for a transition without target that fires in every micro-step.

    The hint depends on whether the guard reads time and whether the source is a superstate.
    """
    source = automaton.source_mode(transition)
    reads_time = any(
        isinstance(part, FunctionCall) and part.function in TIME_FUNCTIONS
        for part in walk(transition.when.tree)
    )
    if not reads_time and not transition.wait:
        return "`to: []` starts nothing anew: write `rising(...)`"
    if source in automaton.superstates:
        hint = (
            f"`to: []` starts no time anew, and `to: {source.name}` starts what is inside anew: let"
        )
        return (
            f"{hint} a mode of a region beside go to itself when `in({source.name}) and after(...)`"
        )
    hint = f"`to: []` starts nothing anew: write `to: {source.name}` and `after(...)`"
    return hint if reads_time else f"{hint}, or `rising(...)`"


def _possible_successors(
    automaton: Automaton, chart: Chart, transition: Transition
) -> Iterator[str]:
    """Yield the keys of transitions that can follow a transition in the same tick.

    An internal transition (without target) is followed by itself. There are no successors of
    completions, histories and waits.
    """
    if transition.is_completion or transition.history:
        return
    if not transition.targets:
        yield transition.key  # an elapsed wait remains elapsed
        return
    if wait_seconds(transition, automaton):
        return
    targets = [chart.nodes[index] for index in chart.transitions[transition.key].targets]
    if any(target.kind == "history" for target in targets):
        return
    entered = {node.index for target in targets for node in chart.entry_set(target, ())}
    ancestors = {node.index for target in targets for node in chart.ancestors(target)}
    for index in sorted(entered | ancestors):
        mode = automaton.modes_by_key.get(chart.nodes[index].mode_key)
        for other in mode.transitions if mode else ():
            if other.targets and not wait_seconds(other, automaton):
                yield other.key


def _find_endless_witness(
    automaton: Automaton, chart: Chart, cycle: Cycle, query_engine: QueryEngine
) -> Witness | None:
    """Return values at which a cycle is taken in every micro-step; None if no case is certain.

    All guards of the cycle hold, no competing guard holds, and no variable changes within a tick.
    """
    if not _has_required_events(automaton, chart, cycle):
        return None
    path = SymbolicPath()
    guards: list[Expr] = []
    no_rivals: list[Expr] = []
    try:
        for each in cycle:
            snapshot = GuardSnapshot(automaton, automaton.source_mode(each), path)
            guards.append(snapshot.lower_expression(each.when.tree))
            for other in _competing_transitions(automaton, chart, each, cycle):
                no_rivals.append(Unary("not", snapshot.lower_expression(other.when.tree)))
    except (KeyError, SpecError):
        return None
    still = [Unary("not", Ref(name)) for name in path.domains if name.startswith(CHANGED_PREFIX)]
    query = query_engine.build_query(path, (*guards, *no_rivals, *still))
    moving = (AGE_PREFIXES if cycle[0].targets else ()) + (DELAYED_PREFIXES if still else ())
    if not _is_constant_in_tick(automaton, query.variables, moving):
        return None
    answer = query_engine.answer(query)
    return answer if isinstance(answer, Witness) else None


def _has_required_events(automaton: Automaton, chart: Chart, cycle: Cycle) -> bool:
    """Return whether the events of a cycle can occur in every micro-step.

    The predecessor of each transition with events raises one of them. In addition, some transition
    has no events, or an input or a transition outside of the cycle gives it one.
    """
    if not any(each.events for each in cycle):
        return True
    before = (cycle[-1], *cycle[:-1])
    pairs = zip(before, cycle, strict=True)
    if not all({*last.raises} & {*each.events} for last, each in pairs if each.events):
        return False
    others = (each for each in automaton.all_transitions if each not in cycle)
    come = {name for each in others for name in each.raises}
    come |= {name for name, signal in chart.events.items() if signal.is_input}
    return any(not each.events or come & {*each.events} for each in cycle)


def _competing_transitions(
    automaton: Automaton, chart: Chart, transition: Transition, cycle: Cycle
) -> Iterator[Transition]:
    """Yield the transitions outside of a cycle that can fire instead of one of it, or before it.

    They leave a mode that is nested with the source of `transition`. Transitions with a wait,
    completions of other modes, transitions of lower precedence in the same mode, and those with
    other events are left out.
    """
    source = automaton.source_mode(transition)
    node = node_of(automaton, source)
    assert node is not None
    rank = transition.priority or 0
    for mode in automaton.all_modes:
        other = node_of(automaton, mode)
        assert other is not None
        for rival in mode.transitions if _are_nested(chart, node, other) else ():
            if rival in cycle or wait_seconds(rival, automaton):
                continue
            if rival.is_completion and mode != source:
                continue  # a mode with transitions is not final, so no other mode completes
            later = mode == source and (rival.priority or 0) > rank
            comes = {*rival.events} & {*transition.events} if rival.events else True
            between = bool(transition.events) and not rival.events
            if between or (comes and not later):
                yield rival


def _are_nested(chart: Chart, node: ChartNode, other: ChartNode) -> bool:
    """Return whether two nodes are nested; the root counts as nested with none."""
    return other.index != ROOT and chart.are_nested(node.index, other.index)


def _is_constant_in_tick(
    automaton: Automaton, variables: list[str], changing_prefixes: tuple[str, ...]
) -> bool:
    """Return whether variables cannot change within a tick.

    A variable can change if it is a mode variable, has one of the given prefixes, or an entry, exit
    or reset assigns to it.
    """
    written = {n for mode in automaton.all_modes for part in mode.jump_assignments for n in part}
    return not any(
        name.startswith(("mode.", *changing_prefixes)) or name.partition(".")[2] in written
        for name in variables
    )
