"""Transition: numbers, waits and timers of transitions, and the jump of a sampled automaton."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction

from language.constants import exact_value
from language.field import by_priority
from language.lower import expression
from language.model import Automaton, Mode
from language.operation import (
    Assign,
    Block,
    Branch,
    Compare,
    Count,
    Expr,
    Op,
    Ref,
    whole,
)
from language.problem import Problems
from language.program import TransitionInfo

MAX_TICKS = 65534
"""Longest wait: the counters are uint16 and count one further (semantics, rule 4)."""


def transition_infos(automaton: Automaton, problems: Problems) -> tuple[TransitionInfo, ...]:
    """Return the transitions, numbered from 1 in the order of the file, waits exact."""
    found: list[TransitionInfo] = []
    for mode in automaton.modes.values():
        for transition in mode.transitions:
            wait = Fraction(0)
            if transition.wait:
                with problems.collecting():
                    wait = exact_value(transition.wait, automaton)
            ticks = math.ceil(wait / automaton.period) if automaton.period else 0
            if transition.wait and wait < 0:
                problems.error("wait", transition.wait.span, "a wait is not negative")
            if transition.wait and ticks > MAX_TICKS:
                label = f"a wait of {ticks} ticks is longer than {MAX_TICKS}"
                problems.error("wait", transition.wait.span, label)
            timed = ticks > 0 if automaton.period else wait > 0
            found.append(
                TransitionInfo(
                    number=len(found) + 1,
                    name=transition.name,
                    source=mode.number,
                    target=automaton.modes[transition.target].number,
                    wait=wait,
                    ticks=ticks,
                    timer=f"timer.{mode.name}_{transition.name}" if timed else None,
                    key=f"{automaton.name} {transition.key}",
                )
            )
    return tuple(found)


def sampled_jump(
    automaton: Automaton,
    mode: Mode,
    infos: tuple[TransitionInfo, ...],
    now: Mapping[str, Expr],
) -> Block:
    """Return the jump of a tick: wait counters, then one transition (rules 3 and 4).

    The guard's first true tick counts 1 here, so a wait of N ticks is over above N.
    """
    known = {**now, **{name: Ref(f"equation.{name}") for name in mode.equations}}
    own = [info for info in infos if info.source == mode.number]
    counters: list[Op] = []
    chain: Block = ()
    for k, transition in reversed(by_priority(mode)):
        info = own[k]
        enabled = expression(transition.when.tree, known)
        if info.timer:
            key = f"{automaton.name} {transition.when.key}"
            counters.insert(0, Count(info.timer, enabled, info.ticks + 1, key))
            enabled = Compare(">", Ref(info.timer), whole(info.ticks))
        chain = (Branch(enabled, _fire(automaton, mode, k, own, known), chain),)
    return (*counters, *chain)


def enter_run(automaton: Automaton, target: Mode) -> list[Op]:
    """Return what starts the run of a mode that is entered."""
    if target.run is None or automaton.model is None:
        return []
    number = automaton.model.modes[target.run.mode].number
    return [Assign("memory.run_mode", whole(number), f"{automaton.name} {target.run.key}")]


def _fire(
    automaton: Automaton, mode: Mode, k: int, own: list[TransitionInfo], known: Mapping[str, Expr]
) -> Block:
    """Resets read the values before and commit together; the counters of the source end."""
    transition = mode.transitions[k]
    target = automaton.modes[transition.target]
    ops: list[Op] = []
    for name, formula in transition.reset.items():
        key = f"{automaton.name} {formula.key}"
        ops.append(Assign(f"work.reset_{name}", expression(formula.tree, known), key))
    ops += [Assign(f"state.{name}", Ref(f"work.reset_{name}")) for name in transition.reset]
    ops += [Assign(info.timer, whole(0)) for info in own if info.timer]
    ops.append(Assign("memory.mode", whole(target.number)))
    ops.append(Assign("memory.fired", whole(own[k].number), own[k].key))
    return (*ops, *enter_run(automaton, target))
