"""The tick of a sampled automaton: latch, advance, jump, update (rule 2)."""

from __future__ import annotations

from collections.abc import Mapping

from language.ir.ops import Assign, Block, Branch, FaultBit, Op, Ref, RunBlock, Switch, Value, real
from language.ir.program import mode_variable
from language.lowering.program_builder import any_fired_condition, clear_fired
from language.lowering.range_saturation import FAULT_HAPPENED, FAULT_PENDING, latch_inputs
from language.lowering.truth_tables import has_table_dependent_equations
from language.model.automaton import Automaton, Region
from language.observers.steady_kalman import LoweredObserver


def tick_block(
    automaton: Automaton,
    advance_blocks: Mapping[str, Block],
    innovation_resets: Mapping[str, Block],
    has_history_block: bool,
    has_start_block: bool,
) -> Block:
    """Return the block `step`.

    The order is: clear fired transitions and fault bits that are not latched, `latch`, advance (or
    `start` in the first tick), jump, `record_history`, updates, `retain_inputs`. `advance_blocks`
    are the advances by mode of the chart; `innovation_resets` set the innovations to 0 that an
    advance may leave unset. `has_history_block` tells whether there is a block `record_history`,
    `has_start_block` whether the first tick runs `start`; without it there is no advance.
    """
    ops: list[Op] = clear_fired(automaton)
    ops += [
        FaultBit(name, value=False) for name, latched in automaton.faults.items() if not latched
    ]
    if latch_inputs(automaton):
        ops.append(RunBlock("latch"))
    if has_start_block:
        ops.append(
            Branch(
                Ref("memory.started"),
                _advance_block(automaton, advance_blocks, innovation_resets),
                (RunBlock("start"),),
            )
        )
    ops += _jump_block(automaton)
    if has_history_block:
        ops.append(RunBlock("record_history"))
    return (*ops, *_update_block(automaton), RunBlock("retain_inputs"))


def reset_innovations(observers: Mapping[str, LoweredObserver], mode: str) -> Block:
    """Return the assignments of 0 to the innovations that the correction of a mode may not set.

    The innovations are those of all observers. Left out are those that the mode's correction
    assigns outside a branch.
    """
    measures = dict.fromkeys(name for each in observers.values() for name in each.info.measures)
    correct = observers[mode].correct if mode in observers else ()
    always_set = {op.target for op in correct if isinstance(op, Assign)}
    names = (f"innovation.{name}" for name in measures)
    return tuple(Assign(name, real(0.0)) for name in names if name not in always_set)


def run_region_block_by_mode(region: Region, block_prefix: str) -> Switch:
    """Return a Switch over the mode of a region that runs `<block_prefix>_<mode>`.

    For the prefixes `update` and `store`, modes without an update are left out.
    """
    modes = region.modes.values()
    targets = [mode for mode in modes if block_prefix not in ("update", "store") or mode.update]
    cases = tuple((mode.number, (RunBlock(f"{block_prefix}_{mode.label}"),)) for mode in targets)
    return Switch(mode_variable("memory.mode", region.name), cases)


def _advance_block(
    automaton: Automaton,
    advance_blocks: Mapping[str, Block],
    innovation_resets: Mapping[str, Block],
) -> Block:
    """Return a Switch over the mode that resets innovations and advances; empty without any."""
    done = {
        m.number: (*innovation_resets[m.name], *advance_blocks[m.name])
        for m in automaton.modes.values()
    }
    cases = tuple((number, block) for number, block in done.items() if block)
    return (Switch("memory.mode", cases),) if cases else ()


def _jump_block(automaton: Automaton) -> Block:
    """Return the jump: equations, truth tables, fault request, transitions.

    Guards read the equations after the advance; a fired transition evaluates them again.
    """
    equations = run_region_block_by_mode(automaton.root_region, "equations")
    ops: list[Op] = [equations]
    if automaton.tables:
        ops += [
            RunBlock("evaluate_tables"),
            *((equations,) if has_table_dependent_equations(automaton) else ()),
        ]
    if automaton.fault_mode:
        ops += [Assign(FAULT_HAPPENED, Ref(FAULT_PENDING)), Assign(FAULT_PENDING, Value(False))]
    if automaton.statechart:
        return (*ops, RunBlock("jump"))
    ops += [run_region_block_by_mode(region, "jump") for region in automaton.all_regions]
    commit: Block = (RunBlock("commit"),) if automaton.regions else ()
    return (*ops, Branch(any_fired_condition(automaton), (*commit, equations)))


def _update_block(automaton: Automaton) -> Block:
    """Return the updates of all regions.

    With parallel regions all updates are evaluated before the first one is stored.
    """
    regions = automaton.all_regions
    updated = [r for r in regions if any(mode.update for mode in r.modes.values())]
    ops: list[Op] = [run_region_block_by_mode(region, "update") for region in updated]
    if automaton.regions:
        ops += [run_region_block_by_mode(region, "store") for region in updated]
    return tuple(ops)
