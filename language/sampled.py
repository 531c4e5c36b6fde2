"""Sampled: a ticking automaton as a Program - latch, advance, jump, update (semantics, rule 2).

Blocks: `init` (before the first tick), `step` (one tick) and what they run:
`start`, `predict_<mode>`, `correct_<mode>`, `run_<mode>` (the advance), `equations_<mode>`,
`jump_<mode>`, `update_<mode>`, `remember`; the blocks of a run are those of its model's field.
"""

from __future__ import annotations

import dataclasses

from language.constants import derive_block, parameter_constants, values_of
from language.evaluate import Scalar
from language.kalman import Kalman, kalman, observer_variables
from language.lower import constant_names, equations, expression
from language.model import Automaton, Mode
from language.operation import (
    Assign,
    Block,
    Branch,
    Choose,
    Compare,
    Expr,
    FaultBit,
    Op,
    Ref,
    Run,
    Value,
    real,
    whole,
)
from language.problem import Problems
from language.program import (
    Constant,
    ModeInfo,
    Program,
    Variable,
)
from language.run import EVENT_LIMIT, run_block, run_motion
from language.transition import enter_run, sampled_jump, transition_infos
from language.wiring import (
    assembled,
    finished,
    initial_ops,
    input_variables,
    state_variables,
)

STALE_CALIBRATION = "stale_calibration"


def sampled_program(automaton: Automaton, problems: Problems) -> Program:
    """Return the Program of a checked sampled automaton. Raises SpecError."""
    builder = _Sampled(automaton, problems)
    program = builder.program()
    problems.stop_if_any()
    return program


class _Sampled:
    """Builds the blocks; one method per phase of the tick."""

    def __init__(self, automaton: Automaton, problems: Problems) -> None:
        self.automaton = automaton
        self.problems = problems
        self.prefix = f"{automaton.name} "
        self.parameters = parameter_constants(automaton, problems)
        self.values: dict[str, Scalar] = values_of(self.parameters)
        self.constants: list[Constant] = list(self.parameters.values())
        self.transitions = transition_infos(automaton, problems)
        self.observers: dict[str, Kalman] = {}
        self.faults: list[str] = []
        self.now = self._names("input")
        self.before = self._names("before")

    def _names(self, group: str) -> dict[str, Expr]:
        automaton = self.automaton
        known = dict(constant_names(automaton))
        known.update({name: Ref(f"{group}.{name}") for name in automaton.inputs})
        known.update({name: Ref(f"state.{name}") for name in automaton.states})
        if automaton.model:
            for mode in automaton.model.modes.values():
                is_in = Compare("==", Ref("memory.run_mode"), whole(mode.number))
                known[f"in {automaton.model.name}.{mode.name}"] = is_in
        return known

    def program(self) -> Program:
        automaton = self.automaton
        modes = automaton.modes.values()
        blocks: dict[str, Block] = {}
        variables = self._variables()
        runs = [mode.run for mode in modes if mode.run]
        if runs:
            motion = run_motion(automaton, runs, self.values, self.problems)
            blocks.update(motion.blocks)
            variables += motion.variables
            self.constants += motion.constants
        for mode in modes:
            blocks.update(self._advance(mode))
        for mode in modes:
            blocks.update(self._phases(mode))
        blocks.update(self._entries())
        self.problems.stop_if_any()
        program = assembled(automaton, blocks, self.constants, variables, self.transitions)
        program = dataclasses.replace(
            program,
            faults=tuple(self.faults),
            run_modes=self._run_modes() if runs else (),
            observers=tuple(observer.info for observer in self.observers.values()),
        )
        return finished(program, entries=("init", "derive", "step"))

    def _phases(self, mode: Mode) -> dict[str, Block]:
        """Equations, jump and update of one mode."""
        ops = equations(mode, dict(self.now), "equation.", self.prefix)
        jump = sampled_jump(self.automaton, mode, self.transitions, self.now)
        found = {f"equations_{mode.name}": tuple(ops), f"jump_{mode.name}": jump}
        if mode.update:
            found[f"update_{mode.name}"] = self._update(mode)
        return found

    def _entries(self) -> dict[str, Block]:
        """What is run from outside, and what these run whatever the mode."""
        inputs = self.automaton.inputs
        return {
            "remember": tuple(Assign(f"before.{n}", Ref(f"input.{n}")) for n in inputs),
            "start": self._start(),
            "derive": derive_block(self.automaton),
            "init": self._init(),
            "step": self._step(),
        }

    def _variables(self) -> list[Variable]:
        automaton = self.automaton
        found = input_variables(automaton, "input")
        measured = [m.observer.measures for m in automaton.modes.values() if m.observer]
        for name in dict.fromkeys(name for measures in measured for name in measures):
            about = f"{name} is a new value in this tick"
            found.append(Variable(f"is_new.{name}", "truth", about=about))
        found += state_variables(automaton)
        found += input_variables(automaton, "before")
        for info in self.transitions:
            if info.timer:
                about = f"ticks that the guard has been true, at most {info.ticks + 1}"
                found.append(Variable(info.timer, "whole", about=about))
        found += observer_variables(automaton)
        found.append(Variable("memory.mode", "whole", about="active mode"))
        found.append(Variable("memory.started", "truth", about="the first tick is done"))
        found.append(Variable("memory.fired", "whole", about="transition of this tick, 0: none"))
        found.append(Variable("memory.faults", "whole", about="latched fault bits"))
        for mode in automaton.modes.values():
            resets = {name for transition in mode.transitions for name in transition.reset}
            for name in sorted(resets):
                unit = str(automaton.states[name].unit.dimension)
                found.append(Variable(f"work.reset_{name}", "real", unit))
            for name in mode.update:
                unit = str(automaton.states[name].unit.dimension)
                found.append(Variable(f"work.next_{name}", "real", unit))
        return list({variable.name: variable for variable in found}.values())

    def _run_modes(self) -> tuple[ModeInfo, ...]:
        assert self.automaton.model
        return tuple(ModeInfo(m.name, m.number) for m in self.automaton.model.modes.values())

    def _advance(self, mode: Mode) -> dict[str, Block]:
        """What carries the states from the tick before to this one."""
        if mode.observer:
            made = kalman(self.automaton, mode, self.before, self.now, self.values, self.problems)
            if made is None:
                return {}
            self.observers[mode.name] = made
            self.constants += made.constants
            return {f"predict_{mode.name}": made.predict, f"correct_{mode.name}": made.correct}
        if mode.run:
            if EVENT_LIMIT not in self.faults:
                self.faults.append(EVENT_LIMIT)
            return {f"run_{mode.name}": run_block(self.automaton, mode.run)}
        return {}

    def _update(self, mode: Mode) -> Block:
        """Assignments that read the values of before this tick's updates, then commit."""
        known = dict(self.now)
        known.update({name: Ref(f"equation.{name}") for name in mode.equations})
        ops: list[Op] = []
        for name, formula in mode.update.items():
            key = self.prefix + formula.key
            ops.append(Assign(f"work.next_{name}", expression(formula.tree, known), key))
        return (*ops, *(Assign(f"state.{name}", Ref(f"work.next_{name}")) for name in mode.update))

    def _start(self) -> Block:
        """The first tick: start values, the initial mode, no advance, only the correction."""
        initial = self.automaton.modes[self.automaton.initial]
        ops = initial_ops(self.automaton, self.now, self.prefix)
        ops.append(Assign("memory.mode", whole(initial.number)))
        ops.append(Assign("memory.started", Value(True)))
        ops += enter_run(self.automaton, initial)
        if initial.name in self.observers:
            ops.append(Run(f"correct_{initial.name}"))
        return tuple(ops)

    def _init(self) -> Block:
        """Before the first tick: nothing has started; solved numbers must fit the calibration."""
        initial = self.automaton.modes[self.automaton.initial]
        ops: list[Op] = [
            Assign("memory.started", Value(False)),
            Assign("memory.mode", whole(initial.number)),
            Assign("memory.faults", whole(0)),
        ]
        stamped = {name for constant in self.constants for name in constant.depends_on}
        for name in sorted(stamped):
            if STALE_CALIBRATION not in self.faults:
                self.faults.append(STALE_CALIBRATION)
            stamp = f"solved.stamp_{name}"
            value = self.parameters[name].value
            unit = self.parameters[name].unit
            self.constants.append(Constant(stamp, "solved", value, unit, depends_on=(name,)))
            changed = Compare("!=", Ref(f"calibration.{name}"), Ref(stamp))
            ops.append(Branch(changed, (FaultBit(STALE_CALIBRATION),)))
        return tuple(ops)

    def _step(self) -> Block:
        modes = list(self.automaton.modes.values())
        advance = [(mode.number, self._carried(mode)) for mode in modes]
        cases = tuple((number, block) for number, block in advance if block)
        ops: list[Op] = [Assign("memory.fired", whole(0))]
        measured = {name: None for o in self.observers.values() for name in o.info.measures}
        ops += [Assign(f"innovation.{name}", real(0.0)) for name in measured]
        then: Block = (Choose("memory.mode", cases),) if cases else ()
        ops.append(Branch(Ref("memory.started"), then, (Run("start"),)))
        ops.append(self._each("equations"))
        ops.append(self._each("jump"))
        fired = Compare("!=", Ref("memory.fired"), whole(0))
        ops.append(Branch(fired, (self._each("equations"),)))
        if any(mode.update for mode in modes):
            ops.append(self._each("update"))
        ops.append(Run("remember"))
        return tuple(ops)

    def _carried(self, mode: Mode) -> Block:
        if mode.name in self.observers:
            return (Run(f"predict_{mode.name}"), Run(f"correct_{mode.name}"))
        return (Run(f"run_{mode.name}"),) if mode.run else ()

    def _each(self, verb: str) -> Choose:
        modes = self.automaton.modes.values()
        wanted = [mode for mode in modes if verb != "update" or mode.update]
        cases = tuple((mode.number, (Run(f"{verb}_{mode.name}"),)) for mode in wanted)
        return Choose("memory.mode", cases)
