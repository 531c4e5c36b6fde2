"""Check of charts: transitions that fire in every micro-step of a tick, until the bound stops them.

Told is what is certain: all that the guards read is fixed within a tick, and no other transition
of the modes that are active comes between.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from language.chart import ROOT, Chart, Node
from language.check_cycle import MOST_WAYS_ROUND, Way, simple_cycles
from language.constants import exact_value
from language.inquiry import Inquiry, Witness
from language.model import Automaton, Transition
from language.moment import ELAPSED, Moment, Story
from language.operation import Expr, Ref, Unary
from language.precedence import node_of
from language.problem import Problems, SpecError
from language.syntax import TIMES, Application, walk

TURNING = "memory.changed"
"""What is true in the first micro-step of a tick only: what goes on goes on without it."""
KEPT = ("memory.previous", "memory.delay")
"""What says of the ticks before how a value changed, as what turns does."""
AGES = (ELAPSED, "memory.every")
"""What is counted anew where a mode is entered."""
ROUND_HINT = "let one of them wait, or its guard exclude the one before"
EVENT_HINT = "let one of them raise no event"


def check_endless(automaton: Automaton, inquiry: Inquiry, problems: Problems) -> None:
    """Warn of transitions of a chart that use up all micro-steps of a tick."""
    chart = automaton.tree
    if chart is None or chart.micro_steps < 2:
        return
    ways = {way.key: way for mode in automaton.all_modes for way in mode.transitions}
    after = {key: list(_followers(automaton, chart, way)) for key, way in ways.items()}
    for members in islice(simple_cycles(after), MOST_WAYS_ROUND):
        way = tuple(ways[key] for key in members)
        found = _forever(automaton, chart, way, inquiry)
        if found:
            path = " -> ".join(f"`{each.source}`" for each in (*way, way[0]))
            label = "this fires in every micro-step of a tick"
            label += f": {path}" if way[0].targets else ""
            hint = EVENT_HINT if way[0].events else ROUND_HINT
            hint = hint if way[0].targets else _staying(automaton, way[0])
            problems.warning("cycle", way[-1].span, label, found.place + hint)


def _staying(automaton: Automaton, way: Transition) -> str:
    """Return what is written in place of a transition without target that fires on and on."""
    own = automaton.source(way)
    reads_time = any(
        isinstance(part, Application) and part.function in TIMES for part in walk(way.when.tree)
    )
    if not reads_time and not way.wait:
        return "`to: []` starts nothing anew: write `rising(...)`"
    if own in automaton.superstates:
        hint = f"`to: []` starts no time anew, and `to: {own.name}` starts what is inside anew: let"
        return f"{hint} a mode of a region beside go to itself when `in({own.name}) and after(...)`"
    hint = f"`to: []` starts nothing anew: write `to: {own.name}` and `after(...)`"
    return hint if reads_time else f"{hint}, or `rising(...)`"


def _followers(automaton: Automaton, chart: Chart, way: Transition) -> Iterator[str]:
    """Yield the transitions that may follow one without any time, by their key paths."""
    if way.completes or way.history:
        return
    if not way.targets:
        yield way.key  # a wait that has elapsed stays so
        return
    if way.wait and exact_value(way.wait, automaton):
        return
    targets = [chart.nodes[index] for index in chart.ways[way.key].targets]
    if any(target.kind == "history" for target in targets):
        return
    entered = {node.index for target in targets for node in chart.first(target, ())}
    around = {node.index for target in targets for node in chart.outer(target)}
    for index in sorted(entered | around):
        mode = automaton.by_key.get(chart.nodes[index].mode)
        for other in mode.transitions if mode else ():
            if other.targets and not (other.wait and exact_value(other.wait, automaton)):
                yield other.key


def _forever(automaton: Automaton, chart: Chart, way: Way, inquiry: Inquiry) -> Witness | None:
    """Return values at which a way round is taken in every micro-step, None if none is certain."""
    if not _has_its_events(automaton, chart, way):
        return None
    story = Story()
    taken: list[Expr] = []
    between: list[Expr] = []
    try:
        for each in way:
            moment = Moment(automaton, automaton.source(each), story)
            taken.append(moment.expression(each.when.tree))
            for other in _rivals(automaton, chart, each, way):
                between.append(Unary("not", moment.expression(other.when.tree)))
    except (KeyError, SpecError):
        return None
    still = [Unary("not", Ref(name)) for name in story.extents if name.startswith(TURNING)]
    question = inquiry.question(story, (*taken, *between, *still))
    moving = (AGES if way[0].targets else ()) + (KEPT if still else ())
    if not _is_fixed(automaton, question.variables, moving):
        return None
    if not question.variables:
        return Witness({}, "") if question.holds_at({}) else None
    found = inquiry.answer(question)
    return found if isinstance(found, Witness) else None


def _has_its_events(automaton: Automaton, chart: Chart, way: Way) -> bool:
    """Tell whether each transition raises the event of the next one, and the first may come."""
    if not any(each.events for each in way):
        return True
    before = (way[-1], *way[:-1])
    pairs = zip(before, way, strict=True)
    if not all({*last.raises} & {*each.events} for last, each in pairs if each.events):
        return False
    others = (each for mode in automaton.all_modes for each in mode.transitions if each not in way)
    come = {name for each in others for name in each.raises}
    come |= {name for name, signal in chart.signals.items() if signal.is_input}
    return any(not each.events or come & {*each.events} for each in way)


def _rivals(
    automaton: Automaton, chart: Chart, transition: Transition, way: Way
) -> Iterator[Transition]:
    """Yield the transitions that may be taken in place of one of a way round, or between two."""
    source = automaton.source(transition)
    node = node_of(automaton, source)
    assert node is not None
    rank = transition.priority or 0
    for mode in automaton.all_modes:
        other = node_of(automaton, mode)
        assert other is not None
        for rival in mode.transitions if _is_near(chart, node, other) else ():
            if rival in way or (rival.wait and exact_value(rival.wait, automaton)):
                continue
            if rival.completes and mode != source:
                continue  # an active mode that has transitions is no final one
            later = mode == source and (rival.priority or 0) > rank
            comes = {*rival.events} & {*transition.events} if rival.events else True
            between = bool(transition.events) and not rival.events
            if between or (comes and not later):
                yield rival


def _is_near(chart: Chart, node: Node, other: Node) -> bool:
    return other.index != ROOT and chart.nested(node.index, other.index)


def _is_fixed(automaton: Automaton, variables: list[str], moving: tuple[str, ...]) -> bool:
    """Tell whether variables keep their values within a tick, whatever fires."""
    written: set[str] = set()
    for mode in automaton.all_modes:
        for formulas in (mode.entry, mode.exit, *(way.reset for way in mode.transitions)):
            written.update(formulas)
    return not any(
        name.startswith(("mode.", *moving)) or name.partition(".")[2] in written
        for name in variables
    )
