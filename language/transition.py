"""Transition: numbers, waits and timers of transitions, and the jump of a sampled automaton."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable, Mapping
from fractions import Fraction
from itertools import accumulate

from language.action import entry, stage, stage_of_regions
from language.activation import guard_names, leave, watch_edges
from language.constants import exact_value
from language.declaration import Formula
from language.lower import equation_names, expression, reads_of
from language.model import Automaton, Mode, Transition
from language.once import once
from language.operation import (
    Assign,
    Block,
    Branch,
    Choose,
    Compare,
    Count,
    Expr,
    Op,
    Ref,
    Run,
    whole,
)
from language.past import Rewinding, rewinds_of
from language.problem import Problems
from language.program import TransitionInfo, fired_variable, mode_variable
from language.region import by_priority, slot
from language.rewind import carry_on, equations_there, known_there
from language.wait import MAX_TICKS, ticks_of, tunable_wait


def transition_infos(automaton: Automaton, problems: Problems) -> tuple[TransitionInfo, ...]:
    """Return the transitions, numbered from 1 in the order of the file, waits exact."""
    found: list[TransitionInfo] = []
    back = {id(rewinding.transition): rewinding.ticks for rewinding in rewinds_of(automaton)}
    for mode in automaton.all_modes:
        for k, transition in enumerate(mode.transitions):
            wait = Fraction(0)
            if transition.wait:
                with problems.collecting():
                    wait = exact_value(transition.wait, automaton)
            ticks = ticks_of(automaton, wait) if automaton.period else 0
            tunable = tunable_wait(automaton, transition.wait)
            if transition.wait and wait < 0:
                problems.error("wait", transition.wait.span, "a wait is not negative")
            if transition.wait and ticks > MAX_TICKS:
                label = f"a wait of {ticks} ticks is longer than {MAX_TICKS}"
                problems.error("wait", transition.wait.span, label)
            timed = (ticks > 0 or tunable is not None) if automaton.period else wait > 0
            target = 0 if automaton.tree else automaton.target(transition).number
            found.append(
                TransitionInfo(
                    number=len(found) + 1,
                    name=transition.name,
                    source=mode.number,
                    target=target,
                    wait=wait,
                    ticks=ticks,
                    timer=f"timer.{mode.label}_{transition.name}" if timed else None,
                    key=f"{automaton.name} {transition.key}",
                    region=mode.region,
                    slot=slot(mode.region, k),
                    rewind=back.get(id(transition), 0),
                    between=_between(automaton, transition),
                    tunable=f"calibration.{tunable}" if tunable else None,
                )
            )
    return tuple(found)


def awaited(info: TransitionInfo) -> Expr:
    """Return the ticks that a guard must have held, without the first."""
    return Ref(info.tunable, whole=True) if info.tunable else whole(info.ticks)


def _between(automaton: Automaton, transition: Transition) -> tuple[str, str] | None:
    """Return the paths of source and target in a chart; where nothing is entered, no target."""
    if automaton.tree is None:
        return None
    way, nodes = automaton.tree.ways[transition.key], automaton.tree.nodes
    source = nodes[way.source].path
    return source, ", ".join(nodes[target].path for target in way.targets)


def infos_of(
    automaton: Automaton, mode: Mode, infos: tuple[TransitionInfo, ...]
) -> tuple[TransitionInfo, ...]:
    """Return the transitions that leave a mode, in the order of the file."""
    first = _first_of(automaton)[mode.key]
    return infos[first : first + len(mode.transitions)]


@once
def _first_of(automaton: Automaton) -> Mapping[str, int]:
    """Return, by the key of a mode, how many transitions leave the modes before it."""
    modes = automaton.all_modes
    counts = accumulate((len(mode.transitions) for mode in modes), initial=0)
    return dict(zip((mode.key for mode in modes), counts, strict=False))


def sampled_jump(
    automaton: Automaton,
    mode: Mode,
    infos: tuple[TransitionInfo, ...],
    now: Mapping[str, Expr],
) -> Block:
    """Return the jump of a tick: wait counters, then one transition (rules 3 and 4).

    The guard's first true tick counts 1 here, so a wait of N ticks is over above N. Where regions
    run in parallel, it only chooses: what that does is left to `sampled_commit` (rule 14).
    """
    everywhere = {**now, **equation_names(automaton, "equation.")}
    edges = watch_edges(automaton, mode, everywhere)
    known = ChainMap(guard_names(automaton, mode), everywhere)
    own = infos_of(automaton, mode, infos)
    counters: list[Op] = []
    chain: Block = ()
    for k, transition in reversed(by_priority(mode)):
        info = own[k]
        enabled = expression(transition.when.tree, known)
        if info.timer:
            key = f"{automaton.name} {transition.when.key}"
            counters.insert(0, Count(info.timer, enabled, info.most, key))
            enabled = Compare(">", Ref(info.timer), awaited(info))
        fire: list[Op] = [Assign(fired_variable(mode.region), whole(info.number), info.key)]
        if not automaton.regions:
            fire = _micro_step(automaton, transition, infos, (now, known), fire)
        chain = (Branch(enabled, tuple(fire), chain),)
    return (*edges, *counters, *chain)


def _micro_step(
    automaton: Automaton,
    transition: Transition,
    infos: tuple[TransitionInfo, ...],
    names: tuple[Mapping[str, Expr], Mapping[str, Expr]],
    fired: list[Op],
) -> list[Op]:
    """Return what a transition does that nothing else fires beside; it may go back for that.

    `names` are those of now, without equations and with them.
    """
    source, target = automaton.source(transition), automaton.target(transition)
    now, known = names
    back: list[Op] = []
    on: Block = ()
    if transition.rewind:
        rewinding = Rewinding(automaton, source, transition, transition.rewind)
        now = known_there(automaton, now)
        known = {**now, **equations_there(rewinding)}
        back, on = [Run(f"back_{rewinding.label}")], carry_on(rewinding)
    return [
        *back,
        *_at_once(automaton, source, transition, known),
        *_taken(automaton, transition, infos),
        *fired,
        *enter_run(automaton, target),
        *entry(automaton, target, target.entry, now),
        *on,
    ]


def sampled_commit(
    automaton: Automaton, infos: tuple[TransitionInfo, ...], now: Mapping[str, Expr], again: Op
) -> Block:
    """Return what the transitions do that the regions have chosen, stage by stage (rule 6).

    Each stage of all regions reads one snapshot; `again` evaluates the equations of the new modes.
    """
    numbers = {info.key: info.number for info in infos}

    def number(way: Transition) -> int:
        return numbers[f"{automaton.name} {way.key}"]

    def stage_of(written: Callable[[Transition], Mapping[str, Formula]]) -> Block:
        return stage_of_regions(automaton, fired_variable, number, written, known)

    known = {**now, **equation_names(automaton, "equation.")}
    before = stage_of(lambda way: automaton.source(way).exit)
    before = (*before, *stage_of(lambda way: way.reset))
    moved = []
    for region in automaton.all_regions:
        ways = [way for mode in region.modes.values() for way in mode.transitions]
        cases = tuple((number(way), _moved(automaton, way, infos)) for way in ways)
        moved.append(Choose(fired_variable(region.name), cases))
    after = stage_of(lambda way: automaton.target(way).entry)
    return (*before, *moved, *((again,) if _entry_reads_equations(automaton) else ()), *after)


def _moved(automaton: Automaton, way: Transition, infos: tuple[TransitionInfo, ...]) -> Block:
    return (*_taken(automaton, way, infos), *enter_run(automaton, automaton.target(way)))


def _entry_reads_equations(automaton: Automaton) -> bool:
    named = equation_names(automaton, "equation.")
    entries = [formula for mode in automaton.all_modes for formula in mode.entry.values()]
    return any(name in named for name in reads_of(formula.tree for formula in entries))


def enter_run(automaton: Automaton, target: Mode) -> list[Op]:
    """Return what starts the run of a mode that is entered, and the covariance of its observer."""
    ops: list[Op] = []
    observer = target.observer
    if observer and observer.gain == "recursive" and observer.covariance == "steady":
        ops.append(Run(f"cover_{target.name}"))
    if target.run is None or automaton.model is None:
        return ops
    number = automaton.model.modes[target.run.mode].number
    ops.append(Assign("memory.run_mode", whole(number), f"{automaton.name} {target.run.key}"))
    return ops


def _at_once(
    automaton: Automaton, mode: Mode, transition: Transition, known: Mapping[str, Expr]
) -> list[Op]:
    """Exit, then reset (rule 6), each committed before the next reads."""
    return [*stage(automaton, mode.exit, known), *stage(automaton, transition.reset, known)]


def _taken(
    automaton: Automaton, transition: Transition, infos: tuple[TransitionInfo, ...]
) -> list[Op]:
    """The counters of the source end; the target is entered.

    Those of a mode that some transition enters with `memory: continue` outlive it, and end where
    another one enters it (rule 4).
    """
    source, target = automaton.source(transition), automaton.target(transition)
    ending = [] if _is_continued(automaton, source) else [*infos_of(automaton, source, infos)]
    if transition.memory == "reset" and _is_continued(automaton, target):
        ending += infos_of(automaton, target, infos)
    ops: list[Op] = [Assign(info.timer, whole(0)) for info in ending if info.timer]
    ops += leave(automaton, source, target)
    mode = mode_variable("memory.mode", transition.region)
    ops.append(Assign(mode, whole(automaton.target(transition).number)))
    return ops


def _is_continued(automaton: Automaton, mode: Mode) -> bool:
    """Tell whether some transition enters a mode with its counters as they were."""
    return (mode.region, mode.name) in _continued(automaton)


@once
def _continued(automaton: Automaton) -> frozenset[tuple[str, str]]:
    ways = [way for mode in automaton.all_modes for way in mode.transitions]
    return frozenset((way.region, way.target) for way in ways if way.memory == "continue")
