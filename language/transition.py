"""Transition: numbers, waits and timers of transitions, and the jump of a sampled automaton."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable, Mapping
from fractions import Fraction
from itertools import accumulate

from language.action import lower_entry, lower_stage, lower_stage_of_regions
from language.activation import detect_edges, guard_memory_bindings, reset_activation
from language.constants import evaluate_exactly
from language.declaration import Formula
from language.lower import equation_bindings, lower_expression, names_read
from language.model import Automaton, Mode, Transition
from language.once import cache_on_owner
from language.operation import (
    Assign,
    Block,
    Branch,
    Compare,
    Count,
    Expr,
    Op,
    Ref,
    RunBlock,
    Switch,
    integer,
)
from language.past import Rollback, rollbacks_of
from language.problem import Problems
from language.program import TransitionInfo, fired_variable, mode_variable
from language.region import guard_slot, transitions_by_priority
from language.rewind import advance_from_crossing, rollback_bindings, rollback_equation_bindings
from language.wait import MAX_WAIT_TICKS, seconds_to_ticks, tunable_wait


def transition_infos(automaton: Automaton, problems: Problems) -> tuple[TransitionInfo, ...]:
    """Return the transitions, numbered from 1 in the order of the file, waits exact."""
    found: list[TransitionInfo] = []
    back = {id(rewinding.transition): rewinding.max_ticks for rewinding in rollbacks_of(automaton)}
    for mode in automaton.all_modes:
        for k, transition in enumerate(mode.transitions):
            wait = Fraction(0)
            if transition.wait:
                with problems.collect_errors():
                    wait = evaluate_exactly(transition.wait, automaton)
            ticks = seconds_to_ticks(automaton, wait) if automaton.period else 0
            tunable = tunable_wait(automaton, transition.wait)
            if transition.wait and wait < 0:
                problems.error("wait", transition.wait.span, "a wait is not negative")
            if transition.wait and ticks > MAX_WAIT_TICKS:
                label = f"a wait of {ticks} ticks is longer than {MAX_WAIT_TICKS}"
                problems.error("wait", transition.wait.span, label)
            timed = (ticks > 0 or tunable is not None) if automaton.period else wait > 0
            target = 0 if automaton.statechart else automaton.target_mode(transition).number
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
                    slot=guard_slot(mode.region, k),
                    rewind_ticks=back.get(id(transition), 0),
                    chart_endpoints=_chart_endpoints(automaton, transition),
                    tunable_wait=f"calibration.{tunable}" if tunable else None,
                )
            )
    return tuple(found)


def wait_ticks(info: TransitionInfo) -> Expr:
    """Return the ticks that a guard must have held, without the first."""
    return Ref(info.tunable_wait, is_integer=True) if info.tunable_wait else integer(info.ticks)


def _chart_endpoints(automaton: Automaton, transition: Transition) -> tuple[str, str] | None:
    """Return the paths of source and target in a chart; where nothing is entered, no target."""
    if automaton.statechart is None:
        return None
    way, nodes = automaton.statechart.transitions[transition.key], automaton.statechart.nodes
    source = nodes[way.source].path
    return source, ", ".join(nodes[target].path for target in way.targets)


def infos_of_mode(
    automaton: Automaton, mode: Mode, infos: tuple[TransitionInfo, ...]
) -> tuple[TransitionInfo, ...]:
    """Return the transitions that leave a mode, in the order of the file."""
    first = _first_index_by_mode(automaton)[mode.key]
    return infos[first : first + len(mode.transitions)]


@cache_on_owner
def _first_index_by_mode(automaton: Automaton) -> Mapping[str, int]:
    """Return, by the key of a mode, how many transitions leave the modes before it."""
    modes = automaton.all_modes
    counts = accumulate((len(mode.transitions) for mode in modes), initial=0)
    return dict(zip((mode.key for mode in modes), counts, strict=False))


def lower_sampled_jump(
    automaton: Automaton,
    mode: Mode,
    infos: tuple[TransitionInfo, ...],
    now: Mapping[str, Expr],
) -> Block:
    """Return the jump of a tick: wait counters, then one transition (rules 3 and 4).

    The guard's first true tick counts 1 here, so a wait of N ticks is over above N. Where regions
    run in parallel, it only chooses: what that does is left to `sampled_commit` (rule 14).
    """
    everywhere = {**now, **equation_bindings(automaton, "equation.")}
    edges = detect_edges(automaton, mode, everywhere)
    known = ChainMap(guard_memory_bindings(automaton, mode), everywhere)
    own = infos_of_mode(automaton, mode, infos)
    counters: list[Op] = []
    chain: Block = ()
    for k, transition in reversed(transitions_by_priority(mode)):
        info = own[k]
        enabled = lower_expression(transition.when.tree, known)
        if info.timer:
            key = f"{automaton.name} {transition.when.key}"
            counters.insert(0, Count(info.timer, enabled, info.timer_limit, key))
            enabled = Compare(">", Ref(info.timer), wait_ticks(info))
        fire: list[Op] = [Assign(fired_variable(mode.region), integer(info.number), info.key)]
        if not automaton.regions:
            fire = _lower_transition(automaton, transition, infos, (now, known), fire)
        chain = (Branch(enabled, tuple(fire), chain),)
    return (*edges, *counters, *chain)


def _lower_transition(
    automaton: Automaton,
    transition: Transition,
    infos: tuple[TransitionInfo, ...],
    bindings: tuple[Mapping[str, Expr], Mapping[str, Expr]],
    fired_ops: list[Op],
) -> list[Op]:
    """Return what a transition does that nothing else fires beside; it may go back for that.

    `bindings` are those of now, without equations and with them.
    """
    source, target = automaton.source_mode(transition), automaton.target_mode(transition)
    now, known = bindings
    back: list[Op] = []
    on: Block = ()
    if transition.rewind:
        rewinding = Rollback(automaton, source, transition, transition.rewind)
        now = rollback_bindings(automaton, now)
        known = {**now, **rollback_equation_bindings(rewinding)}
        back, on = [RunBlock(f"back_{rewinding.block_suffix}")], advance_from_crossing(rewinding)
    return [
        *back,
        *_lower_exit_and_reset(automaton, source, transition, known),
        *_switch_mode(automaton, transition, infos),
        *fired_ops,
        *start_run(automaton, target),
        *lower_entry(automaton, target, target.entry, now),
        *on,
    ]


def lower_sampled_commit(
    automaton: Automaton,
    infos: tuple[TransitionInfo, ...],
    now: Mapping[str, Expr],
    evaluate_equations: Op,
) -> Block:
    """Return what the transitions do that the regions have chosen, stage by stage (rule 6).

    Each stage of all regions reads one snapshot; `evaluate_equations` evaluates the equations of the new modes.
    """
    numbers = {info.key: info.number for info in infos}

    def number(way: Transition) -> int:
        return numbers[f"{automaton.name} {way.key}"]

    def stage_of(written: Callable[[Transition], Mapping[str, Formula]]) -> Block:
        return lower_stage_of_regions(automaton, fired_variable, number, written, known)

    known = {**now, **equation_bindings(automaton, "equation.")}
    before = stage_of(lambda way: automaton.source_mode(way).exit)
    before = (*before, *stage_of(lambda way: way.reset))
    moved = []
    for region in automaton.all_regions:
        ways = [way for mode in region.modes.values() for way in mode.transitions]
        cases = tuple((number(way), _enter_target(automaton, way, infos)) for way in ways)
        moved.append(Switch(fired_variable(region.name), cases))
    after = stage_of(lambda way: automaton.target_mode(way).entry)
    return (
        *before,
        *moved,
        *((evaluate_equations,) if _do_entries_read_equations(automaton) else ()),
        *after,
    )


def _enter_target(
    automaton: Automaton, transition: Transition, infos: tuple[TransitionInfo, ...]
) -> Block:
    return (
        *_switch_mode(automaton, transition, infos),
        *start_run(automaton, automaton.target_mode(transition)),
    )


def _do_entries_read_equations(automaton: Automaton) -> bool:
    named = equation_bindings(automaton, "equation.")
    entries = [formula for mode in automaton.all_modes for formula in mode.entry.values()]
    return any(name in named for name in names_read(formula.tree for formula in entries))


def start_run(automaton: Automaton, target: Mode) -> list[Op]:
    """Return what starts the run of a mode that is entered, and the covariance of its observer."""
    ops: list[Op] = []
    observer = target.observer
    if observer and observer.gain == "recursive" and observer.covariance == "steady":
        ops.append(RunBlock(f"cover_{target.name}"))
    if target.run is None or automaton.model is None:
        return ops
    number = automaton.model.modes[target.run.mode].number
    ops.append(Assign("memory.run_mode", integer(number), f"{automaton.name} {target.run.key}"))
    return ops


def _lower_exit_and_reset(
    automaton: Automaton, mode: Mode, transition: Transition, known: Mapping[str, Expr]
) -> list[Op]:
    """Exit, then reset (rule 6), each committed before the next reads."""
    return [
        *lower_stage(automaton, mode.exit, known),
        *lower_stage(automaton, transition.reset, known),
    ]


def _switch_mode(
    automaton: Automaton, transition: Transition, infos: tuple[TransitionInfo, ...]
) -> list[Op]:
    """The counters of the source end; the target is entered.

    Those of a mode that some transition enters with `memory: continue` outlive it, and end where
    another one enters it (rule 4).
    """
    source, target = automaton.source_mode(transition), automaton.target_mode(transition)
    ending = [] if _keeps_timers(automaton, source) else [*infos_of_mode(automaton, source, infos)]
    if transition.memory == "reset" and _keeps_timers(automaton, target):
        ending += infos_of_mode(automaton, target, infos)
    ops: list[Op] = [Assign(info.timer, integer(0)) for info in ending if info.timer]
    ops += reset_activation(automaton, source, target)
    mode = mode_variable("memory.mode", transition.region)
    ops.append(Assign(mode, integer(automaton.target_mode(transition).number)))
    return ops


def _keeps_timers(automaton: Automaton, mode: Mode) -> bool:
    """Tell whether some transition enters a mode with its counters as they were."""
    return (mode.region, mode.name) in _timer_keeping_targets(automaton)


@cache_on_owner
def _timer_keeping_targets(automaton: Automaton) -> frozenset[tuple[str, str]]:
    ways = [way for mode in automaton.all_modes for way in mode.transitions]
    return frozenset((way.region, way.target) for way in ways if way.memory == "continue")
