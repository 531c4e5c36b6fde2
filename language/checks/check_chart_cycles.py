"""Check of charts: transitions that fire in every micro-step of a tick, until the bound stops them.

Told is what is certain: all that the guards read is fixed within a tick, and no other transition
of the modes that are active comes between.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from language.checks.check_instant_cycles import MAX_CYCLES, Cycle, simple_cycles
from language.expressions.syntax_tree import TIME_FUNCTIONS, FunctionCall, walk
from language.ir.ops import Expr, Ref, Unary
from language.lowering.constants import evaluate_exactly
from language.model.automaton import Automaton, Transition
from language.model.statechart import ROOT, Chart, ChartNode
from language.model.transition_precedence import node_of
from language.smt.guard_snapshot import TIME_IN_MODE, GuardSnapshot, SymbolicPath
from language.smt.query_engine import QueryEngine, Witness
from language.text.diagnostic import Problems, SpecError

CHANGED_PREFIX = "memory.changed"
"""What is true in the first micro-step of a tick only: what goes on goes on without it."""
DELAYED_PREFIXES = ("memory.previous", "memory.delay")
"""What says of the ticks before how a value changed, as what turns does."""
AGE_PREFIXES = (TIME_IN_MODE, "memory.every")
"""What is counted anew where a mode is entered."""
CYCLE_HINT = "let one of them wait, or its guard exclude the one before"
EVENT_HINT = "let one of them raise no event"


def check_chart_cycles(automaton: Automaton, query_engine: QueryEngine, problems: Problems) -> None:
    """Warn of transitions of a chart that use up all micro-steps of a tick."""
    chart = automaton.statechart
    if chart is None or chart.micro_steps < 2:
        return
    ways = {way.key: way for mode in automaton.all_modes for way in mode.transitions}
    after = {key: list(_possible_successors(automaton, chart, way)) for key, way in ways.items()}
    for members in islice(simple_cycles(after), MAX_CYCLES):
        way = tuple(ways[key] for key in members)
        found = _find_endless_witness(automaton, chart, way, query_engine)
        if found:
            path = " -> ".join(f"`{each.source}`" for each in (*way, way[0]))
            label = "this fires in every micro-step of a tick"
            label += f": {path}" if way[0].targets else ""
            hint = EVENT_HINT if way[0].events else CYCLE_HINT
            hint = hint if way[0].targets else _self_loop_hint(automaton, way[0])
            problems.warning("cycle", way[-1].span, label, found.hint_prefix + hint)


def _self_loop_hint(automaton: Automaton, transition: Transition) -> str:
    """Return what is written in place of a transition without target that fires on and on."""
    own = automaton.source_mode(transition)
    reads_time = any(
        isinstance(part, FunctionCall) and part.function in TIME_FUNCTIONS
        for part in walk(transition.when.tree)
    )
    if not reads_time and not transition.wait:
        return "`to: []` starts nothing anew: write `rising(...)`"
    if own in automaton.superstates:
        hint = f"`to: []` starts no time anew, and `to: {own.name}` starts what is inside anew: let"
        return f"{hint} a mode of a region beside go to itself when `in({own.name}) and after(...)`"
    hint = f"`to: []` starts nothing anew: write `to: {own.name}` and `after(...)`"
    return hint if reads_time else f"{hint}, or `rising(...)`"


def _possible_successors(
    automaton: Automaton, chart: Chart, transition: Transition
) -> Iterator[str]:
    """Yield the transitions that may follow one without any time, by their key paths."""
    if transition.is_completion or transition.history:
        return
    if not transition.targets:
        yield transition.key  # a wait that has elapsed stays so
        return
    if transition.wait and evaluate_exactly(transition.wait, automaton):
        return
    targets = [chart.nodes[index] for index in chart.transitions[transition.key].targets]
    if any(target.kind == "history" for target in targets):
        return
    entered = {node.index for target in targets for node in chart.entry_set(target, ())}
    around = {node.index for target in targets for node in chart.ancestors(target)}
    for index in sorted(entered | around):
        mode = automaton.modes_by_key.get(chart.nodes[index].mode_key)
        for other in mode.transitions if mode else ():
            if other.targets and not (other.wait and evaluate_exactly(other.wait, automaton)):
                yield other.key


def _find_endless_witness(
    automaton: Automaton, chart: Chart, cycle: Cycle, query_engine: QueryEngine
) -> Witness | None:
    """Return values at which a way round is taken in every micro-step, None if none is certain."""
    if not _has_required_events(automaton, chart, cycle):
        return None
    path = SymbolicPath()
    taken: list[Expr] = []
    between: list[Expr] = []
    try:
        for each in cycle:
            snapshot = GuardSnapshot(automaton, automaton.source_mode(each), path)
            taken.append(snapshot.lower_expression(each.when.tree))
            for other in _competing_transitions(automaton, chart, each, cycle):
                between.append(Unary("not", snapshot.lower_expression(other.when.tree)))
    except (KeyError, SpecError):
        return None
    still = [Unary("not", Ref(name)) for name in path.domains if name.startswith(CHANGED_PREFIX)]
    query = query_engine.build_query(path, (*taken, *between, *still))
    moving = (AGE_PREFIXES if cycle[0].targets else ()) + (DELAYED_PREFIXES if still else ())
    if not _is_constant_in_tick(automaton, query.variables, moving):
        return None
    if not query.variables:
        return Witness({}, "") if query.holds_at({}) else None
    found = query_engine.answer(query)
    return found if isinstance(found, Witness) else None


def _has_required_events(automaton: Automaton, chart: Chart, cycle: Cycle) -> bool:
    """Tell whether each transition raises the event of the next one, and the first may come."""
    if not any(each.events for each in cycle):
        return True
    before = (cycle[-1], *cycle[:-1])
    pairs = zip(before, cycle, strict=True)
    if not all({*last.raises} & {*each.events} for last, each in pairs if each.events):
        return False
    others = (
        each for mode in automaton.all_modes for each in mode.transitions if each not in cycle
    )
    come = {name for each in others for name in each.raises}
    come |= {name for name, signal in chart.events.items() if signal.is_input}
    return any(not each.events or come & {*each.events} for each in cycle)


def _competing_transitions(
    automaton: Automaton, chart: Chart, transition: Transition, cycle: Cycle
) -> Iterator[Transition]:
    """Yield the transitions that may be taken in place of one of a way round, or between two."""
    source = automaton.source_mode(transition)
    node = node_of(automaton, source)
    assert node is not None
    rank = transition.priority or 0
    for mode in automaton.all_modes:
        other = node_of(automaton, mode)
        assert other is not None
        for rival in mode.transitions if _are_nested(chart, node, other) else ():
            if rival in cycle or (rival.wait and evaluate_exactly(rival.wait, automaton)):
                continue
            if rival.is_completion and mode != source:
                continue  # an active mode that has transitions is no final one
            later = mode == source and (rival.priority or 0) > rank
            comes = {*rival.events} & {*transition.events} if rival.events else True
            between = bool(transition.events) and not rival.events
            if between or (comes and not later):
                yield rival


def _are_nested(chart: Chart, node: ChartNode, other: ChartNode) -> bool:
    return other.index != ROOT and chart.are_nested(node.index, other.index)


def _is_constant_in_tick(
    automaton: Automaton, variables: list[str], changing_prefixes: tuple[str, ...]
) -> bool:
    """Tell whether variables keep their values within a tick, whatever fires."""
    written: set[str] = set()
    for mode in automaton.all_modes:
        for formulas in (mode.entry, mode.exit, *(way.reset for way in mode.transitions)):
            written.update(formulas)
    return not any(
        name.startswith(("mode.", *changing_prefixes)) or name.partition(".")[2] in written
        for name in variables
    )
