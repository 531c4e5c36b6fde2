"""Tick: what a sampled automaton does at once - latch, advance, jump, update (rule 2)."""

from __future__ import annotations

from collections.abc import Mapping

from language.decision import decided_equations
from language.kalman import Kalman
from language.limit import HAPPENED, PENDING, latch
from language.model import Automaton, Region
from language.operation import Assign, Block, Branch, Choose, FaultBit, Op, Ref, Run, Value, real
from language.program import mode_variable
from language.wiring import any_fired, none_fired


def tick_block(
    automaton: Automaton,
    carried: Mapping[str, Block],
    silent: Mapping[str, Block],
    keeps: bool,
    starts: bool,
) -> Block:
    """Return `step`: `carried` is the advance of each mode of the chart, `silent` what is set
    before it: innovations that it does not set are 0. `keeps` tells whether delays do, `starts`
    whether the first tick is another one than those after it.
    """
    ops: list[Op] = none_fired(automaton)
    ops += [
        FaultBit(name, value=False) for name, latched in automaton.faults.items() if not latched
    ]
    if latch(automaton):
        ops.append(Run("latch"))
    if starts:
        ops.append(
            Branch(Ref("memory.started"), _advance(automaton, carried, silent), (Run("start"),))
        )
    ops += _jump(automaton)
    if keeps:
        ops.append(Run("keep"))
    return (*ops, *_update(automaton), Run("remember"))


def silence(observers: Mapping[str, Kalman], mode: str) -> Block:
    """Return what sets the innovations to 0 that a mode does not set whenever it corrects."""
    found = dict.fromkeys(name for one in observers.values() for name in one.info.measures)
    correct = observers[mode].correct if mode in observers else ()
    sure = {op.target for op in correct if isinstance(op, Assign)}
    names = (f"innovation.{name}" for name in found)
    return tuple(Assign(name, real(0.0)) for name in names if name not in sure)


def by_mode(region: Region, verb: str) -> Choose:
    """Return the choice of a block by the mode of a region."""
    modes = region.modes.values()
    wanted = [mode for mode in modes if verb not in ("update", "store") or mode.update]
    cases = tuple((mode.number, (Run(f"{verb}_{mode.label}"),)) for mode in wanted)
    return Choose(mode_variable("memory.mode", region.name), cases)


def _advance(
    automaton: Automaton, carried: Mapping[str, Block], silent: Mapping[str, Block]
) -> Block:
    done = {m.number: (*silent[m.name], *carried[m.name]) for m in automaton.modes.values()}
    cases = tuple((number, block) for number, block in done.items() if block)
    return (Choose("memory.mode", cases),) if cases else ()


def _jump(automaton: Automaton) -> Block:
    """Guards read the equations after the advance; a transition makes them anew."""
    equations = by_mode(automaton.chart, "equations")
    ops: list[Op] = [equations]
    if automaton.tables:
        ops += [Run("decide"), *((equations,) if decided_equations(automaton) else ())]
    if automaton.fault_mode:
        ops += [Assign(HAPPENED, Ref(PENDING)), Assign(PENDING, Value(False))]
    if automaton.tree:
        return (*ops, Run("jump"))
    ops += [by_mode(region, "jump") for region in automaton.all_regions]
    commit: Block = (Run("commit"),) if automaton.regions else ()
    return (*ops, Branch(any_fired(automaton), (*commit, equations)))


def _update(automaton: Automaton) -> Block:
    regions = automaton.all_regions
    updated = [r for r in regions if any(mode.update for mode in r.modes.values())]
    ops: list[Op] = [by_mode(region, "update") for region in updated]
    if automaton.regions:
        ops += [by_mode(region, "store") for region in updated]
    return tuple(ops)
