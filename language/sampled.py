"""Sampled: a ticking automaton as a Program - latch, advance, jump, update (rule 2).

Blocks: `init` (before the first tick), `step` (one tick) and what they run:
`start`, `predict_<mode>`, `correct_<mode>`, `run_<mode>` (the advance), `equations_<mode>`,
`jump_<mode>`, `keep` (delayed values), `update_<mode>`, `remember`; the blocks of a run are those
of its model's field.
"""

from __future__ import annotations

import dataclasses

from language.action import (
    committing,
    entry,
    first_entry,
    reading,
)
from language.activation import elapse
from language.constants import derive_block, parameter_constants, values_of
from language.covariance import COVARIANCE_RANGE
from language.decision import decision_block
from language.evaluate import Scalar
from language.fault import fault_names, with_fault_transitions
from language.invariant import INVARIANTS, invariant_block
from language.kalman import Kalman, kalman
from language.limit import (
    MICRO_STEP_LIMIT,
    first_latched,
    latch,
)
from language.lower import equation_names, equations, variable_names
from language.memory import delays_of, keep_block
from language.micro_step import chart_blocks, chart_variables, first_entries, nothing_left
from language.model import CHART, Automaton, Mode
from language.operation import (
    Assign,
    Block,
    Op,
    Run,
    Value,
    whole,
)
from language.past import keep_past
from language.problem import Problems
from language.program import (
    Constant,
    ModeInfo,
    MotionInfo,
    Program,
)
from language.recursive import recursive
from language.rewind import REWIND_LIMIT, advance_blocks, rewind_blocks
from language.run import EVENT_LIMIT, run_motion, start_regions
from language.sampled_variable import sampled_variables
from language.situation import charting_of, names_now, names_of
from language.stamp import STALE_CALIBRATION, STAMPS, stamps_block, stamps_of
from language.tick import by_mode, silence, tick_block
from language.transition import enter_run, sampled_commit, sampled_jump, transition_infos
from language.wiring import (
    assembled,
    enter_initial,
    finished,
    initial_ops,
)

STARTED = Assign("memory.started", Value(True))


def sampled_program(automaton: Automaton, problems: Problems) -> Program:
    """Return the Program of a checked sampled automaton. Raises SpecError."""
    builder = _Sampled(automaton, problems)
    program = builder.program()
    problems.stop_if_any()
    return program


class _Sampled:
    """Builds the blocks; one method per phase of the tick."""

    def __init__(self, automaton: Automaton, problems: Problems) -> None:
        automaton = with_fault_transitions(automaton)
        self.automaton = automaton
        self.problems = problems
        self.prefix = f"{automaton.name} "
        self.parameters = parameter_constants(automaton, problems)
        self.values: dict[str, Scalar] = values_of(self.parameters)
        self.constants: list[Constant] = list(self.parameters.values())
        self.transitions = transition_infos(automaton, problems)
        self.observers: dict[str, Kalman] = {}
        self.faults: list[str] = []
        self.motion: MotionInfo | None = None
        self.before = names_of(automaton, "before")
        self.delays = delays_of(automaton)
        self.all, self.now = names_now(automaton)
        self.charting = charting_of(automaton, self.transitions)
        if self.charting and MICRO_STEP_LIMIT not in self.faults and self.charting.may_fault:
            self.faults.append(MICRO_STEP_LIMIT)

    def program(self) -> Program:
        automaton = self.automaton
        modes = automaton.modes.values()
        blocks: dict[str, Block] = {}
        of_chart = chart_variables(self.charting) if self.charting else []
        variables = sampled_variables(automaton, self.transitions, self.delays, of_chart)
        runs = [mode.run for mode in modes if mode.run]
        if runs:
            motion = run_motion(automaton, runs, self.values, self.problems)
            blocks.update(motion.blocks)
            variables += motion.variables
            self.constants += motion.constants
            self.motion = motion.info
        for mode in modes:
            blocks.update(self._advance(mode))
        for region in automaton.all_regions:
            for mode in region.modes.values():
                blocks.update(self._phases(mode))
        again = by_mode(automaton.chart, "equations")
        if self.charting:
            blocks.update(chart_blocks(self.charting, again))
        elif automaton.regions:
            blocks["commit"] = sampled_commit(automaton, self.transitions, self.now, again)
        blocks.update(self._entries())
        blocks.update(invariant_block(automaton, self.now))
        self.problems.stop_if_any()
        program = assembled(automaton, blocks, self.constants, variables, self.transitions)
        program = dataclasses.replace(
            program,
            faults=fault_names(automaton, blocks, self.faults, self.problems),
            run_modes=self._run_modes() if runs else (),
            observers=tuple(observer.info for observer in self.observers.values()),
            motion=self.motion,
        )
        return finished(program, entries=("init", "derive", STAMPS, "step", INVARIANTS))

    def _phases(self, mode: Mode) -> dict[str, Block]:
        """Equations, jump and update of one mode."""
        found: dict[str, Block] = {}
        if mode.region == CHART:
            ops = equations(mode, dict(self.now), "equation.", self.prefix)
            found[f"equations_{mode.label}"] = tuple(ops)
        back = rewind_blocks(self.automaton, mode, self.now)
        if back and REWIND_LIMIT not in self.faults:
            self.faults.append(REWIND_LIMIT)
        found.update(back)
        if self.charting is None:
            jump = sampled_jump(self.automaton, mode, self.transitions, self.now)
            found[f"jump_{mode.label}"] = jump
        if mode.update:
            found[f"update_{mode.label}"] = self._update(mode)
            found[f"store_{mode.label}"] = self._store(mode)
        return found

    def _entries(self) -> dict[str, Block]:
        """What is run from outside, and what these run whatever the mode."""
        inputs = self.automaton.inputs
        stamps = stamps_of(self.automaton, self.constants, self.parameters, self.problems)
        self.constants += stamps
        if stamps and STALE_CALIBRATION not in self.faults:
            self.faults.append(STALE_CALIBRATION)
        found: dict[str, Block] = {STAMPS: stamps_block(stamps)} if stamps else {}
        return found | {
            "latch": latch(self.automaton),
            "remember": tuple(
                Assign(f"before.{n}", ref)
                for n, ref in variable_names(self.automaton, "input").items()
                if n in inputs
            ),
            "decide": decision_block(self.automaton, self.all),
            "keep": self._keep(),
            "start": self._start(),
            "derive": derive_block(self.automaton),
            "init": self._init(bool(stamps)),
            "step": self._step(),
        }

    def _run_modes(self) -> tuple[ModeInfo, ...]:
        assert self.automaton.model
        return tuple(ModeInfo(m.name, m.number) for m in self.automaton.model.modes.values())

    def _advance(self, mode: Mode) -> dict[str, Block]:
        """What carries the states from the tick before to this one."""
        found: dict[str, Block] = {}
        if mode.run:
            if mode.run.follow and EVENT_LIMIT not in self.faults:
                self.faults.append(EVENT_LIMIT)
            found.update(advance_blocks(self.automaton, mode))
        if mode.observer:
            make = recursive if mode.observer.gain == "recursive" else kalman
            made = make(self.automaton, mode, self.before, self.now, self.values, self.problems)
            if made is None:
                return {}
            self.observers[mode.name] = made
            self.constants += made.constants
            found.update(made.spreads)
            found[f"predict_{mode.name}"] = made.predict
            found[f"correct_{mode.name}"] = made.correct
            if made.enter:
                found[f"cover_{mode.name}"] = made.enter
            if mode.observer.limits and COVARIANCE_RANGE not in self.faults:
                self.faults.append(COVARIANCE_RANGE)
        return found

    def _update(self, mode: Mode) -> Block:
        """The assignments of an update read the values of before this tick's updates."""
        known = {**self.now, **equation_names(self.automaton, "equation.")}
        ops = reading(self.automaton, mode.update, known, "next")
        return (*ops, *(() if self.automaton.regions else self._store(mode)))

    def _store(self, mode: Mode) -> Block:
        """What an update computed, committed together."""
        return tuple(committing(self.automaton, mode.update, "next"))

    def _start(self) -> Block:
        """The first tick: start values, the initial mode, no advance, only the correction."""
        initial = self.automaton.modes[self.automaton.initial]
        ops = initial_ops(self.automaton, self.now, self.prefix)
        ops += enter_initial(self.automaton, "memory.mode")
        ops += nothing_left(self.charting) if self.charting else ()
        if self.automaton.model and any(mode.run for mode in self.automaton.modes.values()):
            ops += start_regions(self.automaton.model)
        ops.append(STARTED)
        ops += enter_run(self.automaton, initial)
        ops += self._first_entries(initial)
        starts = [o.start for name, o in self.observers.items() if name == initial.name and o.start]
        starts += [observer.start for observer in self.observers.values() if observer.start]
        ops += starts[0] if starts else ()
        ops += silence(self.observers, initial.name)
        if initial.name in self.observers:
            ops.append(Run(f"correct_{initial.name}"))
        return tuple(ops)

    def _first_entries(self, initial: Mode) -> Block:
        automaton = self.automaton
        if automaton.tree:
            return first_entries(automaton, automaton.tree, self.now)
        return entry(automaton, initial, first_entry(automaton), self.now)

    def _init(self, stamps: bool) -> Block:
        """Before the first tick: nothing has started (rule 16a)."""
        ops: list[Op] = [
            *((Assign("memory.started", Value(False)),) if self._starts() else ()),
            *enter_initial(self.automaton, "memory.mode"),
            *(nothing_left(self.charting) if self.charting else ()),
            Assign("memory.faults", whole(0)),
            *first_latched(self.automaton),
        ]
        return (*ops, Run(STAMPS)) if stamps else tuple(ops)

    def _step(self) -> Block:
        carried = {mode.name: self._carried(mode) for mode in self.automaton.modes.values()}
        silent = {name: silence(self.observers, name) for name in self.automaton.modes}
        keeps = bool(self._keep())
        return tick_block(self.automaton, carried, silent, keeps, self._starts())

    def _starts(self) -> bool:
        """Tell whether the first tick does more than `init` has done, or later ones advance."""
        entered = (*enter_initial(self.automaton, "memory.mode"), STARTED)
        return self._start() != entered or any(map(self._carried, self.automaton.modes.values()))

    def _keep(self) -> Block:
        """What is kept of a tick once it has jumped."""
        delayed = keep_block(self.automaton, self.delays, self.all)
        return (*delayed, *elapse(self.automaton), *keep_past(self.automaton))

    def _carried(self, mode: Mode) -> Block:
        if mode.name in self.observers:
            return (Run(f"predict_{mode.name}"), Run(f"correct_{mode.name}"))
        return (Run(f"run_{mode.name}"),) if mode.run else ()
