"""Lowering of a sampled automaton to a Program (rule 2).

Blocks: `init` (before the first tick), `step` (one tick) and the blocks that these run: `latch`,
`start`, `predict_<mode>`, `correct_<mode>` and `run_<mode>` (the advance), `equations_<mode>`,
`evaluate_tables` (truth tables), `jump_<mode>`, `record_history` (delayed values, ticks),
`update_<mode>` and `retain_inputs`. A run adds the blocks of the vector field of its model.
"""

from __future__ import annotations

import dataclasses

from language.charts.micro_step import (
    chart_blocks,
    chart_variables,
    clear_histories,
    initial_chart_stages,
)
from language.ir.ops import Assign, Block, Op, RunBlock, Value, integer
from language.ir.program import Constant, IntegrationInfo, ModeInfo, Program
from language.ir.root_region import CHART
from language.lowering.action_stages import (
    bindings_of_target,
    commit_stage,
    initial_stages,
    lower_transition,
    read_stage,
)
from language.lowering.calibration_stamp import (
    COMPARE_STAMPS,
    STALE_CALIBRATION,
    calibration_stamps,
    compare_stamps_block,
)
from language.lowering.constants import constant_values, derive_block, parameter_constants
from language.lowering.delay_buffers import record_delays_block, sampled_delays_of
from language.lowering.edge_detection import count_ticks
from language.lowering.expressions import equation_bindings, lower_equations, variable_bindings
from language.lowering.fault_mode import add_fault_transitions, fault_names
from language.lowering.invariants import INVARIANTS, invariant_blocks
from language.lowering.program_builder import (
    assemble_program,
    enter_initial_modes,
    finalise_program,
    lower_initial_values,
)
from language.lowering.range_saturation import initialise_latched_inputs, latch_inputs
from language.lowering.tick_history import record_tick_history
from language.lowering.transition_metadata import start_run, transition_infos
from language.lowering.truth_tables import truth_table_block
from language.model.automaton import Automaton, Mode
from language.model.declaration import MICRO_STEP_LIMIT_FAULT
from language.numerics.evaluate import Scalar
from language.observers.covariance_update import COVARIANCE_RANGE
from language.observers.recursive_kalman import lower_recursive_observer
from language.observers.steady_kalman import LoweredObserver, lower_steady_observer
from language.programs.model_run import EVENT_LIMIT, build_run_step, start_run_regions
from language.programs.name_bindings import (
    base_bindings,
    chart_context_of,
    current_bindings,
    sampled_variables,
)
from language.programs.rewind import REWIND_LIMIT, advance_blocks, rollback_blocks
from language.programs.sampled_transitions import lower_sampled_commit, lower_sampled_jump
from language.programs.tick import reset_innovations, run_region_block_by_mode, tick_block
from language.text.diagnostic import Problems

SET_STARTED = Assign("memory.started", Value(True))
"""The assignment that marks the first tick as done."""


def lower_sampled_automaton(automaton: Automaton, problems: Problems) -> Program:
    """Return the Program of a checked sampled automaton.

    Raises SpecError if `problems` has an error, also an earlier one.
    """
    builder = _SampledLowering(automaton, problems)
    program = builder.build()
    problems.raise_if_errors()
    return program


class _SampledLowering:
    """Builder of the blocks of a sampled automaton, with one method for each phase of the tick."""

    def __init__(self, automaton: Automaton, problems: Problems) -> None:
        automaton = add_fault_transitions(automaton)
        self.automaton = automaton
        self.problems = problems
        self.prefix = f"{automaton.name} "
        self.parameters = parameter_constants(automaton, problems)
        self.values: dict[str, Scalar] = constant_values(self.parameters)
        self.constants: list[Constant] = list(self.parameters.values())
        self.transitions = transition_infos(automaton, problems)
        self.observers: dict[str, LoweredObserver] = {}
        self.faults: list[str] = []
        self.motion_info: IntegrationInfo | None = None
        self.previous_bindings = base_bindings(automaton, "before")
        self.delays = sampled_delays_of(automaton)
        self.bindings, self.base_bindings = current_bindings(automaton)
        self.chart_context = chart_context_of(automaton, self.transitions)
        if (
            self.chart_context
            and MICRO_STEP_LIMIT_FAULT not in self.faults
            and self.chart_context.may_reach_limit
        ):
            self.faults.append(MICRO_STEP_LIMIT_FAULT)

    def build(self) -> Program:
        """Return the Program; SpecError if a problem was reported before its assembly."""
        automaton = self.automaton
        modes = automaton.modes.values()
        blocks: dict[str, Block] = {}
        of_chart = chart_variables(self.chart_context) if self.chart_context else []
        variables = sampled_variables(automaton, self.transitions, self.delays, of_chart)
        runs = [mode.run for mode in modes if mode.run]
        if runs:
            motion = build_run_step(automaton, runs, self.values, self.problems)
            blocks.update(motion.blocks)
            variables += motion.variables
            self.constants += motion.constants
            self.motion_info = motion.info
        for mode in modes:
            blocks.update(self._advance_blocks(mode))
        for region in automaton.all_regions:
            for mode in region.modes.values():
                blocks.update(self._mode_blocks(mode))
        again = run_region_block_by_mode(automaton.root_region, "equations")
        if self.chart_context:
            blocks.update(chart_blocks(self.chart_context, again))
        elif automaton.regions:
            blocks["commit"] = lower_sampled_commit(
                automaton, self.transitions, self.base_bindings, again
            )
        blocks.update(self._entry_point_blocks())
        blocks.update(invariant_blocks(automaton, self.base_bindings))
        self.problems.raise_if_errors()
        program = assemble_program(automaton, blocks, self.constants, variables, self.transitions)
        program = dataclasses.replace(
            program,
            faults=fault_names(automaton, blocks, self.faults, self.problems),
            run_modes=self._run_mode_infos() if runs else (),
            observers=tuple(observer.info for observer in self.observers.values()),
            integration=self.motion_info,
        )
        return finalise_program(
            program, entries=("init", "derive", COMPARE_STAMPS, "step", INVARIANTS)
        )

    def _mode_blocks(self, mode: Mode) -> dict[str, Block]:
        """Return the blocks of one mode: equations, rollbacks, jump, update and store."""
        found: dict[str, Block] = {}
        if mode.region == CHART:
            ops = lower_equations(mode, dict(self.base_bindings), "equation.", self.prefix)
            found[f"equations_{mode.label}"] = tuple(ops)
        back = rollback_blocks(self.automaton, mode, self.base_bindings)
        if back and REWIND_LIMIT not in self.faults:
            self.faults.append(REWIND_LIMIT)
        found.update(back)
        if self.chart_context is None:
            jump = lower_sampled_jump(self.automaton, mode, self.transitions, self.base_bindings)
            found[f"jump_{mode.label}"] = jump
        if mode.update:
            found[f"update_{mode.label}"] = self._update_block(mode)
            found[f"store_{mode.label}"] = self._store_block(mode)
        return found

    def _entry_point_blocks(self) -> dict[str, Block]:
        """Return the blocks that are run from outside or in every tick."""
        inputs = self.automaton.inputs
        stamps = calibration_stamps(self.automaton, self.constants, self.parameters, self.problems)
        self.constants += stamps
        if stamps and STALE_CALIBRATION not in self.faults:
            self.faults.append(STALE_CALIBRATION)
        found: dict[str, Block] = {COMPARE_STAMPS: compare_stamps_block(stamps)} if stamps else {}
        return found | {
            "latch": latch_inputs(self.automaton),
            "retain_inputs": tuple(
                Assign(f"before.{n}", ref)
                for n, ref in variable_bindings(self.automaton, "input").items()
                if n in inputs
            ),
            "evaluate_tables": truth_table_block(self.automaton, self.bindings),
            "record_history": self._history_block(),
            "start": self._start_block(),
            "derive": derive_block(self.automaton),
            "init": self._init_block(bool(stamps)),
            "step": self._step_block(),
        }

    def _run_mode_infos(self) -> tuple[ModeInfo, ...]:
        """Return the modes of the model with their numbers."""
        assert self.automaton.model
        return tuple(ModeInfo(m.name, m.number) for m in self.automaton.model.modes.values())

    def _advance_blocks(self, mode: Mode) -> dict[str, Block]:
        """Return the blocks of a mode's run and observer, which advance the states by a period."""
        found: dict[str, Block] = {}
        if mode.run:
            if mode.run.follow and EVENT_LIMIT not in self.faults:
                self.faults.append(EVENT_LIMIT)
            found.update(advance_blocks(self.automaton, mode))
        if mode.observer:
            lower_observer = (
                lower_recursive_observer
                if mode.observer.gain == "recursive"
                else lower_steady_observer
            )
            observer = lower_observer(
                self.automaton,
                mode,
                self.previous_bindings,
                self.base_bindings,
                self.values,
                self.problems,
            )
            if observer is None:
                return {}
            self.observers[mode.name] = observer
            self.constants += observer.constants
            found.update(observer.covariance_blocks)
            found[f"predict_{mode.name}"] = observer.predict
            found[f"correct_{mode.name}"] = observer.correct
            if observer.entry_covariance:
                found[f"entry_covariance_{mode.name}"] = observer.entry_covariance
            if mode.observer.variance_limits and COVARIANCE_RANGE not in self.faults:
                self.faults.append(COVARIANCE_RANGE)
        return found

    def _update_block(self, mode: Mode) -> Block:
        """Return the update of a mode, which reads the values before this tick's updates (rule 2b).

        With parallel regions the values are stored by the block `store_<mode>`.
        """
        known = {**self.base_bindings, **equation_bindings(self.automaton, "equation.")}
        ops = read_stage(self.automaton, mode.update, known, "next")
        return (*ops, *(() if self.automaton.regions else self._store_block(mode)))

    def _store_block(self, mode: Mode) -> Block:
        """Return the operations that store the results of a mode's update."""
        return tuple(commit_stage(self.automaton, mode.update, "next"))

    def _start_block(self) -> Block:
        """Return the first tick: start values, initial modes, entries, correction (rule 2b)."""
        initial = self.automaton.modes[self.automaton.initial]
        ops = lower_initial_values(self.automaton, self.base_bindings, self.prefix)
        ops += enter_initial_modes(self.automaton, "memory.mode")
        ops += clear_histories(self.chart_context) if self.chart_context else ()
        if self.automaton.model and any(mode.run for mode in self.automaton.modes.values()):
            ops += start_run_regions(self.automaton.model)
        ops.append(SET_STARTED)
        ops += start_run(self.automaton, initial)
        ops += self._initial_entries(initial)
        starts = [
            o.initial_covariance
            for name, o in self.observers.items()
            if name == initial.name and o.initial_covariance
        ]
        starts += [
            observer.initial_covariance
            for observer in self.observers.values()
            if observer.initial_covariance
        ]
        ops += starts[0] if starts else ()
        ops += reset_innovations(self.observers, initial.name)
        if initial.name in self.observers:
            ops.append(RunBlock(f"correct_{initial.name}"))
        return tuple(ops)

    def _initial_entries(self, initial: Mode) -> Block:
        """Return the entry actions of the initial modes."""
        automaton, now = self.automaton, self.base_bindings
        if self.chart_context:
            stages = initial_chart_stages(self.chart_context)
        else:
            stages = initial_stages((0, r.modes[r.initial]) for r in automaton.all_regions)
        read = bindings_of_target(automaton, initial, now, now)
        return lower_transition(automaton, stages, read)

    def _init_block(self, has_stamps: bool) -> Block:
        """Return the block `init`, which states that nothing has started (rule 16a)."""
        ops: list[Op] = [
            *((Assign("memory.started", Value(False)),) if self._has_start_block() else ()),
            *enter_initial_modes(self.automaton, "memory.mode"),
            *(clear_histories(self.chart_context) if self.chart_context else ()),
            Assign("memory.faults", integer(0)),
            *initialise_latched_inputs(self.automaton),
        ]
        return (*ops, RunBlock(COMPARE_STAMPS)) if has_stamps else tuple(ops)

    def _step_block(self) -> Block:
        """Return the block `step`."""
        advances = {
            mode.name: self._advance_of_mode(mode) for mode in self.automaton.modes.values()
        }
        resets = {name: reset_innovations(self.observers, name) for name in self.automaton.modes}
        has_history = bool(self._history_block())
        return tick_block(self.automaton, advances, resets, has_history, self._has_start_block())

    def _has_start_block(self) -> bool:
        """Return whether the first tick differs from `init` or later ticks have an advance."""
        entered = (*enter_initial_modes(self.automaton, "memory.mode"), SET_STARTED)
        return self._start_block() != entered or any(
            map(self._advance_of_mode, self.automaton.modes.values())
        )

    def _history_block(self) -> Block:
        """Return the operations that record delays, timers and history after the jump."""
        delayed = record_delays_block(self.delays, self.bindings)
        return (*delayed, *count_ticks(self.automaton), *record_tick_history(self.automaton))

    def _advance_of_mode(self, mode: Mode) -> Block:
        """Return the operations that run the advance of a mode; empty without observer and run."""
        if mode.name in self.observers:
            return (RunBlock(f"predict_{mode.name}"), RunBlock(f"correct_{mode.name}"))
        return (RunBlock(f"run_{mode.name}"),) if mode.run else ()
