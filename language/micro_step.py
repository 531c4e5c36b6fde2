"""Micro-step: what the jump of a tick does in a chart - select, leave, reset, enter, again.

Rules 3, 6, 7 and 15. Exits run from the inside out, one stage for each depth, then the resets of
all transitions as one stage, then entries from the outside in; each stage reads one snapshot. The
first micro-step takes what has no event and what has the first one by priority alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from language.action import committing, entry, reading
from language.chart import ROOT, Chart, Node
from language.charting import (
    FIRST,
    NOT_YET,
    OVER,
    Charting,
    enters_flag,
    kept,
    leaves_flag,
    taken,
    wish,
)
from language.declaration import Formula
from language.entering import entering
from language.event import EVENT, WAITING, arrived, event_variables, put, taken as take_event
from language.leaving import leave, leaving_blocks
from language.limit import MICRO_STEP_LIMIT
from language.lower import reads_of
from language.model import Automaton
from language.operation import (
    Assign,
    Binary,
    Block,
    Branch,
    Choose,
    Compare,
    Expr,
    FaultBit,
    Loop,
    Op,
    Ref,
    Run,
    Store,
    Value,
    add,
    whole,
)
from language.program import LOG, LOGGED, Variable, fired_variable
from language.selecting import selection_blocks, selection_variables

BUSY = Ref("work.is_busy")
STEPS = Ref("work.steps")
TURN = "work.turn"


def chart_blocks(charting: Charting, again: Op) -> dict[str, Block]:
    """Return `jump` and what it runs; `again` evaluates the equations of the active modes."""
    blocks = {**selection_blocks(charting), **leaving_blocks(charting)}
    blocks["commit"] = _commit(charting, again)
    if not charting.several:
        return {**blocks, "jump": _one_step(charting)}
    return {**blocks, "micro_step": _step(charting), "jump": _several(charting)}


def chart_variables(charting: Charting) -> list[Variable]:
    """Return the variables of all of it; `finished` leaves out what is not used."""
    found = [*selection_variables(charting), *event_variables(charting.size)]
    for node in charting.chart.nodes[ROOT + 1 :]:
        about = f"what `{node.path}` was left in"
        found.append(Variable(kept(node).name, "whole", about=about))
        for verb, flag in (("left", leaves_flag), ("entered", enters_flag)):
            about = f"`{node.path}` is {verb} in this micro-step"
            found.append(Variable(flag(node).name, "truth", about=about))
    found.append(Variable(STEPS.name, "whole", about="micro-steps of this tick"))
    found.append(Variable(TURN, "whole"))
    found.append(Variable(BUSY.name, "truth", about="another micro-step follows"))
    size = _log_size(charting)
    about = "transitions of this tick, 0 after those of a micro-step"
    found.append(Variable(LOG, "whole", size=size, about=about))
    found.append(Variable(LOGGED, "whole", about="how many entries of log"))
    return found


def nothing_left(charting: Charting) -> Block:
    """Return what forgets the histories of before."""
    nodes = (charting.chart.nodes[index] for index in sorted(charting.remembered))
    return tuple(Assign(kept(node).name, whole(NOT_YET)) for node in nodes)


def first_entries(automaton: Automaton, chart: Chart, now: Mapping[str, Expr]) -> Block:
    """Return the entries of all nodes that are active at the start, one stage for each depth."""
    active = [(chart.depth(node), automaton.by_key.get(node.mode)) for node in chart.started()]
    initial = automaton.modes[automaton.initial]
    ops: list[Op] = []
    for depth in sorted({depth for depth, _ in active}):
        written = {
            name: formula
            for own, mode in active
            if own == depth and mode
            for name, formula in mode.entry.items()
        }
        ops += entry(automaton, initial, written, now)
    return tuple(ops)


def _one_step(charting: Charting) -> Block:
    """The only micro-step of a tick; an event that it does not take is a fault if one waits."""
    ops: list[Op] = []
    if charting.size:
        ops += arrived(charting.chart)
    ops += [
        Run("select_transitions"),
        *_heard(charting),
        Branch(_any(charting, _chosen(charting)), (Run("commit"),)),
    ]
    if charting.size > 1:
        ops.append(Branch(WAITING, (FaultBit(MICRO_STEP_LIMIT),)))
    return tuple(ops)


def _several(charting: Charting) -> Block:
    """Micro-steps until nothing is enabled and no event waits, or the bound is reached."""
    ops: list[Op] = [Assign(LOGGED, whole(0)), Assign(STEPS.name, whole(0))]
    if charting.size:
        ops += arrived(charting.chart)
    ops += [
        Assign(flag.name, Value(value))
        for flag, value in ((BUSY, True), (FIRST, True), (OVER, False))
    ]
    turns = charting.chart.micro_steps + charting.size + 2
    return (*ops, Loop(turns, TURN, (Branch(BUSY, (Run("micro_step"),)),)))


def _step(charting: Charting) -> Block:
    """One turn: a micro-step, or the next event, or the end."""
    fired = _any(charting, _chosen(charting))
    over: Block = (FaultBit(MICRO_STEP_LIMIT), Assign(BUSY.name, Value(False)))
    done: list[Op] = [
        Run("commit"),
        _noted(charting, whole(0)),
        Assign(STEPS.name, add(STEPS, whole(1))),
    ]
    if charting.size:
        done.append(Assign(EVENT.name, whole(0)))
    reached = Compare("==", STEPS, whole(charting.chart.micro_steps))
    done.append(Assign(OVER.name, reached))
    end: Block = (Assign(BUSY.name, Value(False)),)
    if charting.size:
        late: Block = (Branch(OVER, over, take_event()),)
        end = (Branch(WAITING, late, end),)
    ops: list[Op] = [Run("select_transitions"), *_heard(charting)]
    ops.append(Branch(fired, (Branch(OVER, over, tuple(done)),), end))
    return (*ops, Assign(FIRST.name, Value(False)))


def _heard(charting: Charting) -> Block:
    return (Run("hear"),) if len(charting.chart.regions) > 1 else ()


def _chosen(charting: Charting) -> Callable[[str], str]:
    """The variable of what a region takes: a single one always takes what it wishes for."""
    return taken if len(charting.chart.regions) > 1 else wish


def _any(charting: Charting, chosen: Callable[[str], str]) -> Expr:
    found: Expr | None = None
    for region in charting.chart.regions:
        here = Compare("!=", Ref(chosen(region.region)), whole(0))
        found = here if found is None else Binary("or", found, here)
    assert found is not None
    return found


def _commit(charting: Charting, again: Op) -> Block:
    """What the transitions do that are taken."""
    ops: list[Op] = []
    leaving = [n for n in charting.chart.nodes if (m := charting.mode(n)) and m.exit]
    coming = [n for n in charting.chart.nodes if (m := charting.mode(n)) and m.entry]
    ops += [Assign(leaves_flag(node).name, Value(False)) for node in leaving]
    ops += [Assign(enters_flag(node).name, Value(False)) for node in coming]
    ops += _left(charting)
    for depth in sorted({charting.chart.depth(node) for node in leaving}, reverse=True):
        nodes = [node for node in leaving if charting.chart.depth(node) == depth]
        ops += _stage(
            charting, [(leaves_flag(n), charting.automaton.by_key[n.mode].exit) for n in nodes]
        )
    ops += _resets(charting)
    ops += _entered(charting)
    ops += _entries(charting, coming, again)
    return (*ops, again)


def _left(charting: Charting) -> Block:
    """Note what fired, and leave what that leaves."""
    ops: list[Op] = []
    for region in charting.chart.regions:
        chosen = Ref(_chosen(charting)(region.region))
        cases = []
        for transition, way in charting.ways_in(region.region):
            if way.domain is not None:
                block = (leave(charting.chart.nodes[way.domain]),)
                cases.append((charting.info(transition).number, block))
        if not charting.ways_in(region.region):
            continue
        log: Block = (Assign(fired_variable(region.region), chosen),)
        if charting.several:
            log = (*log, _noted(charting, chosen))
        ops.append(Branch(Compare("!=", chosen, whole(0)), log))
        if cases:
            ops.append(Choose(chosen.name, tuple(cases)))
    return tuple(ops)


def _log_size(charting: Charting) -> int:
    """Return how many entries a tick has at most: one of each region in a step, and its end."""
    return charting.chart.micro_steps * (len(charting.chart.regions) + 1)


def _noted(charting: Charting, entry: Expr) -> Op:
    """Write an entry. There is always room; the test says so to tools that follow ranges."""
    written = (Store(LOG, Ref(LOGGED), entry), Assign(LOGGED, add(Ref(LOGGED), whole(1))))
    return Branch(Compare("<", Ref(LOGGED), whole(_log_size(charting))), written)


def _stage(charting: Charting, flagged: list[tuple[Ref, Mapping[str, Formula]]]) -> Block:
    """Assignments of the nodes that have their flag set: all read, then all commit."""
    automaton = charting.automaton
    reads = [
        Branch(flag, tuple(reading(automaton, written, charting.everywhere)))
        for flag, written in flagged
    ]
    commits = [Branch(flag, tuple(committing(automaton, written))) for flag, written in flagged]
    return (*reads, *commits)


def _resets(charting: Charting) -> Block:
    """The resets of all transitions as one stage, and the events that they raise."""
    automaton = charting.automaton
    reads: list[Op] = []
    commits: list[Op] = []
    for region in charting.chart.regions:
        read, commit = [], []
        for transition, _ in charting.ways_in(region.region):
            number = charting.info(transition).number
            written = transition.reset
            if written:
                read.append((number, tuple(reading(automaton, written, charting.everywhere))))
            ops = tuple(committing(automaton, written))
            for name in transition.raises:
                ops = (*ops, *put(charting.chart, name, charting.size))
            if ops:
                commit.append((number, ops))
        chosen = _chosen(charting)(region.region)
        reads += [Choose(chosen, tuple(read))] if read else []
        commits += [Choose(chosen, tuple(commit))] if commit else []
    return (*reads, *commits)


def _entered(charting: Charting) -> Block:
    ops: list[Op] = []
    for region in charting.chart.regions:
        cases = []
        for transition, way in charting.ways_in(region.region):
            block = entering(charting, transition, way)
            if block:
                cases.append((charting.info(transition).number, block))
        if cases:
            ops.append(Choose(_chosen(charting)(region.region), tuple(cases)))
    return tuple(ops)


def _entries(charting: Charting, coming: list[Node], again: Op) -> Block:
    """Entries from the outside in; the equations that they read are evaluated before each stage."""
    ops: list[Op] = []
    automaton = charting.automaton
    for depth in sorted({charting.chart.depth(node) for node in coming}):
        nodes = [node for node in coming if charting.chart.depth(node) == depth]
        written = [automaton.by_key[node.mode].entry for node in nodes]
        reads = reads_of(formula.tree for each in written for formula in each.values())
        if any(name in charting.everywhere and name not in charting.now for name in reads):
            ops.append(again)
        ops += _stage(charting, list(zip(map(enters_flag, nodes), written, strict=True)))
    return tuple(ops)
