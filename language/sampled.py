"""Sampled: a ticking automaton as a Program - latch, advance, jump, update (semantics, rule 2).

Blocks: `init` (before the first tick), `step` (one tick) and what they run:
`start`, `predict_<mode>`, `correct_<mode>`, `run_<mode>` (the advance), `equations_<mode>`,
`jump_<mode>`, `update_<mode>`, `remember`; the blocks of a run are those of its model's field.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction

from language.constants import (
    derive_block,
    exact_value,
    parameter_constants,
    values_of,
)
from language.evaluate import Scalar
from language.exponential import exponential
from language.field import (
    Field,
    by_mode,
    by_priority,
    enter,
    field_blocks,
    field_variables,
    jump,
)
from language.kalman import Kalman, kalman, observer_variables
from language.lower import constant_names, equations, expression, rounded, tunables_of
from language.model import Automaton, Formula, Mode, Run as ModelRun
from language.motion import RUN_HALVINGS, Method, motion_blocks, motion_variables
from language.problem import Problems
from language.program import (
    Assign,
    Block,
    Branch,
    Choose,
    Compare,
    Constant,
    Count,
    Expr,
    FaultBit,
    Loop,
    ModeInfo,
    Op,
    Program,
    Ref,
    Run,
    TransitionInfo,
    Value,
    Variable,
    real,
    subtract,
    whole,
)
from language.rk4 import rk4
from language.wiring import (
    finished,
    initial_ops,
    input_variables,
    output_wires,
    state_variables,
)

MAX_TICKS = 65535
"""Longest wait: the counters are uint16 (semantics, rule 4)."""
EVENT_LIMIT = "event_limit"
STALE_CALIBRATION = "stale_calibration"


def sampled_program(automaton: Automaton, problems: Problems) -> Program:
    """Return the Program of a checked sampled automaton. Raises SpecError."""
    builder = _Sampled(automaton, problems)
    program = builder.program()
    problems.stop_if_any()
    return program


def transition_infos(automaton: Automaton, problems: Problems) -> tuple[TransitionInfo, ...]:
    """Return the transitions, numbered from 1 in the order of the file, waits exact."""
    found: list[TransitionInfo] = []
    for mode in automaton.modes.values():
        for transition in mode.transitions:
            wait = Fraction(0)
            with problems.collecting():
                wait = exact_value(transition.wait, automaton) if transition.wait else wait
            ticks = math.ceil(wait / automaton.period) if automaton.period else 0
            if transition.wait and wait < 0:
                problems.error("wait", transition.wait.span, "a wait is not negative")
            if transition.wait and ticks >= MAX_TICKS:
                label = f"a wait of {ticks} ticks is longer than {MAX_TICKS - 1}"
                problems.error("wait", transition.wait.span, label)
            timed = ticks > 0 if automaton.period else wait > 0
            timer = f"timer.{mode.name}_{transition.name}" if timed else None
            found.append(
                TransitionInfo(
                    len(found) + 1,
                    transition.name,
                    mode.number,
                    automaton.modes[transition.target].number,
                    wait,
                    ticks,
                    timer,
                    f"{automaton.name} {transition.key}",
                )
            )
    return tuple(found)


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
        runs = [mode for mode in modes if mode.run]
        if runs:
            made, more = self._motion(runs)
            blocks.update(made)
            variables += more
        for mode in modes:
            blocks.update(self._advance(mode))
        for mode in modes:
            known = dict(self.now)
            ops = equations(mode, known, "equation.", self.prefix)
            blocks[f"equations_{mode.name}"] = tuple(ops)
        for mode in modes:
            blocks[f"jump_{mode.name}"] = self._jump(mode)
            if mode.update:
                blocks[f"update_{mode.name}"] = self._update(mode)
        blocks["remember"] = tuple(
            Assign(f"before.{name}", Ref(f"input.{name}")) for name in automaton.inputs
        )
        blocks["start"] = self._start()
        blocks["derive"] = derive_block(automaton)
        blocks["init"] = self._init()
        blocks["step"] = self._step()
        return finished(
            Program(
                name=automaton.name,
                number="float64",
                period=automaton.period,
                major_step=automaton.period or Fraction(0),
                constants=tuple(self.constants),
                variables=tuple(variables),
                outputs=output_wires(automaton),
                modes=tuple(ModeInfo(mode.name, mode.number) for mode in modes),
                transitions=self.transitions,
                faults=tuple(self.faults),
                functions=(),
                blocks=blocks,
                run_modes=self._run_modes() if runs else (),
                observers=tuple(observer.info for observer in self.observers.values()),
                defaults=defaults_of(automaton),
            ),
            entries=("init", "derive", "step"),
        )

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

    def _motion(self, runs: list[Mode]) -> tuple[dict[str, Block], list[Variable]]:
        """The field of the model, as it moves inside a tick."""
        automaton, model = self.automaton, self.automaton.model
        assert model
        first = runs[0].run
        assert first
        for mode in runs:
            run = mode.run
            if run and (run.method, run.substeps) != (first.method, first.substeps):
                label = "all runs of an automaton have one method and one number of substeps"
                self.problems.error("run", run.span, label)
        field = Field(
            model,
            constant_names(automaton),
            self._run_inputs(),
            "memory.run_mode",
            f"{model.name} ",
        )
        blocks = field_blocks(field)
        method = self._method(field, first, blocks)
        self.constants += method.constants
        made = {
            **blocks,
            **method.blocks,
            **motion_blocks(field, method, RUN_HALVINGS, lambda mode: None),
        }
        for mode in model.modes.values():
            made[f"switch_{mode.name}"] = self._run_jump(field, mode)
        variables = [
            Variable("memory.run_mode", "whole", about=f"mode of the run of {model.name}"),
            Variable("work.left", "real", "s", about="rest of the substep"),
            Variable("work.event", "whole"),
            Variable("work.substep", "whole"),
            *field_variables(field),
            *motion_variables(field, method),
        ]
        return made, variables

    def _run_inputs(self) -> dict[str, Expr]:
        """A run reads the inputs of the tick before; what is no input here has its default."""
        automaton, model = self.automaton, self.automaton.model
        assert model
        found: dict[str, Expr] = {}
        for name, thing in model.inputs.items():
            if name in automaton.inputs:
                found[name] = Ref(f"before.{name}")
            elif thing.default is not None:
                found[name] = (
                    Value(bool(thing.default)) if thing.truth else real(rounded(thing.default))
                )
            else:
                label = f"the run needs an input `{name}`: `{model.name}` has no default for it"
                self.problems.error("run", automaton.span, label)
                found[name] = real(0.0)
        return found

    def _method(self, field: Field, run: ModelRun, blocks: Mapping[str, Block]) -> Method:
        automaton = self.automaton
        assert automaton.period is not None
        if run.method == "rk4":
            return rk4(field)
        h = float(automaton.period / run.substeps)
        formulas: list[Formula] = []
        for mode in field.automaton.modes.values():
            formulas += mode.equations.values()
            formulas += [Formula(balance.left, "") for balance in mode.flow.values()]
            formulas += [Formula(balance.right, "") for balance in mode.flow.values()]
        depends_on = tunables_of(automaton, formulas)
        return exponential(field, blocks, self.values, h, depends_on, run.span, self.problems)

    def _run_jump(self, field: Field, mode: Mode) -> Block:
        for transition in mode.transitions:
            if transition.wait:
                label = "a run inside a tick follows transitions without a wait only"
                self.problems.error("run", transition.wait.span, label)
        enabled: dict[int, Expr] = {k: Ref(f"work.guard_{k}") for k in range(len(mode.transitions))}
        fire: dict[int, Block] = {
            k: (enter(field, transition),) for k, transition in enumerate(mode.transitions)
        }
        return jump(field, mode, enabled, fire)

    def _advance(self, mode: Mode) -> dict[str, Block]:
        """What carries the states from the tick before to this one."""
        if mode.observer:
            made = kalman(self.automaton, mode, self.before, self.values, self.problems)
            if made is None:
                return {}
            self.observers[mode.name] = made
            self.constants += made.constants
            return {f"predict_{mode.name}": made.predict, f"correct_{mode.name}": made.correct}
        if mode.run:
            return {f"run_{mode.name}": self._run(mode, mode.run)}
        return {}

    def _run(self, mode: Mode, run: ModelRun) -> Block:
        automaton, model = self.automaton, self.automaton.model
        assert model and automaton.period is not None
        if EVENT_LIMIT not in self.faults:
            self.faults.append(EVENT_LIMIT)
        field = Field(model, {}, {}, "memory.run_mode", "")
        follow: Block = (by_mode(field, "switch"),)
        jumped = Compare("<", Ref("work.event"), whole(run.events))
        segment: Block = (
            Assign("work.h", Ref("work.left")),
            by_mode(field, "move"),
            Assign("work.left", subtract(Ref("work.left"), Ref("work.elapsed"))),
            Branch(
                Ref("work.crossed"),
                (Branch(jumped, follow, (FaultBit(EVENT_LIMIT), Assign("work.left", real(0.0)))),),
            ),
        )
        left = Compare(">", Ref("work.left"), real(0.0))
        body: Block = (
            Assign(
                "work.left", real(float(automaton.period / run.substeps)), self.prefix + run.key
            ),
            Loop(run.events + 1, "work.event", (Branch(left, segment),)),
        )
        return body if run.substeps == 1 else (Loop(run.substeps, "work.substep", body),)

    def _jump(self, mode: Mode) -> Block:
        """Wait counters, then the enabled transition with the smallest priority (rules 3, 4)."""
        known = dict(self.now)
        known.update({name: Ref(f"equation.{name}") for name in mode.equations})
        field = Field(self.automaton, self.now, {}, "memory.mode", self.prefix)
        infos = [info for info in self.transitions if info.source == mode.number]
        ops: list[Op] = []
        enabled: dict[int, Expr] = {}
        fire: dict[int, Block] = {}
        for k, transition in by_priority(mode):
            info = infos[k]
            guard = expression(transition.when.tree, known)
            key = self.prefix + transition.when.key
            if info.timer:
                ops.append(Count(info.timer, guard, info.ticks + 1, key))
                enabled[k] = Compare(">", Ref(info.timer), whole(info.ticks))
            else:
                enabled[k] = guard
            fire[k] = self._fire(field, mode, k, infos, known)
        chain = _chain(mode, enabled, fire)
        return (*ops, *chain)

    def _fire(
        self,
        field: Field,
        mode: Mode,
        k: int,
        infos: list[TransitionInfo],
        known: Mapping[str, Expr],
    ) -> Block:
        transition = mode.transitions[k]
        ops: list[Op] = []
        for name, formula in transition.reset.items():
            key = self.prefix + formula.key
            ops.append(Assign(f"work.reset_{name}", expression(formula.tree, known), key))
        ops += [Assign(f"state.{name}", Ref(f"work.reset_{name}")) for name in transition.reset]
        ops += [Assign(info.timer, whole(0)) for info in infos if info.timer]
        ops.append(enter(field, transition))
        ops.append(Assign("memory.fired", whole(infos[k].number), infos[k].key))
        ops += self._enter_run(self.automaton.modes[transition.target])
        return tuple(ops)

    def _enter_run(self, target: Mode) -> list[Op]:
        model = self.automaton.model
        if target.run is None or model is None:
            return []
        number = model.modes[target.run.mode].number
        return [Assign("memory.run_mode", whole(number), self.prefix + target.run.key)]

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
        ops += self._enter_run(initial)
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


def _chain(mode: Mode, enabled: Mapping[int, Expr], fire: Mapping[int, Block]) -> Block:
    ops: Block = ()
    for k, _ in reversed(by_priority(mode)):
        ops = (Branch(enabled[k], fire[k], ops),)
    return ops


def defaults_of(automaton: Automaton) -> dict[str, float | bool]:
    """Return the values of inputs that nothing is connected to."""
    found: dict[str, float | bool] = {}
    for name, thing in automaton.inputs.items():
        if thing.default is not None:
            found[name] = bool(thing.default) if thing.truth else rounded(thing.default)
    return found
