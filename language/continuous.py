"""Continuous: a continuous automaton as a Program that an engine moves from event to event.

Entries: `step` is one major step (language/stepping.py) and what the C has, after `init`. An engine
runs its parts: `start` (start values from the inputs), `equations` (the values of now), `watch`
(what each guard is now), `jump` (one micro-step: `memory.fired` is the transition, 0 if none),
`flow` (states over `work.h`, up to the first change of a guard, after `work.elapsed`); and `dense`,
`peek`: with the states as they were at its start, what they were `work.s` after it, on the method's
own polynomial (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.6).

The inputs that hold are `before.u`: `latch` takes those of now, at the end of a step.
An input that varies inside a step is `before.u + s (work.rise_u + s work.bend_u)` at the time s of
the step: a parabola through its values at the ends and the middle, the times of RK4's stages.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection

from language.action import discrete_variables, first_entry
from language.constants import derive_block, parameter_constants, values_of
from language.field import (
    Field,
    at_state,
    at_time,
    by_mode,
    entered,
    field_blocks,
    field_variables,
    switch,
)
from language.history import (
    AGE,
    History,
    alarm_names,
    alarms_of,
    delayed,
    fill_block,
    histories_of,
    history_variables,
    record_block,
)
from language.integration import method_of
from language.invariant import INVARIANTS, invariant_block, invariant_variables
from language.linear import Point
from language.lower import Names, equation_names, equations, variable_names
from language.model import Automaton, Mode, Transition
from language.motion import FLOW_HALVINGS, motion_blocks, motion_variables
from language.operation import (
    Assign,
    Binary,
    Block,
    Branch,
    Choose,
    Expr,
    Loop,
    Ref,
    Run,
    Unary,
    Value,
    add,
    multiply,
    real,
    whole,
)
from language.parallel import Selection, parallel_blocks, parallel_step
from language.parameter import constant_names
from language.problem import Problems
from language.program import Program, TransitionInfo, Variable, fired_variable
from language.region import in_modes, slots
from language.stepping import (
    BETWEEN,
    LIVELOCK,
    ZENO,
    Waits,
    begun,
    ended,
    is_over,
    of_mode,
    stepping_blocks,
    stepping_variables,
    waits_of,
)
from language.transition import infos_of, transition_infos
from language.turning import edge_names, forgotten, level_variables, settled
from language.wiring import (
    assembled,
    enter_initial,
    finished,
    initial_ops,
    input_variables,
    mode_and_fired,
    none_fired,
    state_variables,
)

ENTRIES = ("init", "derive", "step")
PARTS = (
    "latch",
    "start",
    "equations",
    "watch",
    "jump",
    "limit",
    "flow",
    "elapse",
    "dense",
    "peek",
    "record",
    INVARIANTS,
)
"""What an engine runs one by one; of a Program with inputs that vary there is no `step`."""


def continuous_program(
    automaton: Automaton, problems: Problems, varying: Collection[str] = ()
) -> Program:
    """Return the Program of a checked continuous automaton. Raises SpecError.

    `varying` names the inputs that change inside a step.
    """
    parameters = parameter_constants(automaton, problems)
    transitions = transition_infos(automaton, problems)
    variables_known = variable_names(automaton, "before")
    inputs = {name: variables_known[name] for name in automaton.inputs}
    known = {
        **constant_names(automaton),
        **variables_known,
        **in_modes(automaton, "memory.mode"),
    }
    histories = histories_of(automaton)
    known.update(delayed(automaton, histories))
    moving = {**inputs, **{name: _parabola(name) for name in varying}}
    field = Field(
        automaton,
        known,
        moving,
        "memory.mode",
        f"{automaton.name} ",
        bool(varying or histories),
        _remembered(automaton),
    )
    flows = field_blocks(field)
    point = Point(automaton, values_of(parameters), {})
    method, info = method_of(
        automaton.method, field, flows, point, automaton.step, automaton.span, problems
    )
    armed = {slot: f"memory.armed_{slot}" for slot in field.slots}
    alarms = alarms_of(automaton)
    waits = waits_of(transitions, alarms)
    selection = _selection(automaton, transitions, waits)
    halvings = FLOW_HALVINGS[automaton.numbers]
    blocks = {
        **flows,
        **method.blocks,
        **motion_blocks(
            field, method, Ref("work.merge"), halvings, lambda mode: armed, Ref("work.is_wait")
        ),
        **stepping_blocks(field, waits, (AGE.name,) if histories else ()),
    }
    for mode in automaton.modes.values():
        ops = equations(mode, dict(known), "equation.", field.prefix)
        blocks[f"equations_{mode.name}"] = tuple(ops)
        blocks[f"jump_{mode.name}"] = _jump(field, mode, transitions, selection)
    if automaton.regions:
        blocks.update(parallel_blocks(field, selection))
    blocks.update(invariant_block(automaton, known))
    blocks.update(_entries(field, known, waits, histories))
    problems.stop_if_any()
    constants = (*parameters.values(), *method.constants)
    variables = [*_variables(automaton, field), *stepping_variables(field, waits)]
    variables += motion_variables(field, method)
    variables += [Variable(name, "real") for name in _courses(varying)]
    variables += history_variables(histories)
    variables += [Variable(alarm.variable, "truth") for alarm in alarms]
    program = assembled(automaton, blocks, constants, variables, transitions)
    program = dataclasses.replace(program, motion=info, faults=(ZENO, LIVELOCK))
    entries = (*(ENTRIES if not varying else ENTRIES[:2]), *PARTS)
    return finished(program, entries, keep=(*BETWEEN, *_courses(varying)))


def _parabola(name: str) -> Expr:
    s, bend = Ref("work.s"), Ref(f"work.bend_{name}")
    inner = add(Ref(f"work.rise_{name}"), multiply(s, bend))
    return add(Ref(f"before.{name}"), multiply(s, inner))


def _courses(varying: Collection[str]) -> list[str]:
    return [f"work.{part}_{name}" for name in varying for part in ("rise", "bend")]


def _variables(automaton: Automaton, field: Field) -> list[Variable]:
    return [
        *input_variables(automaton, "input"),
        *state_variables(automaton),
        *input_variables(automaton, "before"),
        *mode_and_fired(automaton, "micro-step"),
        *(Variable(f"memory.armed_{slot}", "truth") for slot in field.slots),
        *discrete_variables(automaton),
        *invariant_variables(automaton),
        *field_variables(field),
        *level_variables(automaton),
        Variable("work.merge", "real", "s", about="what crosses within it is one instant"),
    ]


def _selection(automaton: Automaton, infos: tuple[TransitionInfo, ...], waits: Waits) -> Selection:
    by_key = {info.key: info for info in infos}
    begins, ends = begun(waits), ended(waits)

    def info_of(transition: Transition) -> TransitionInfo:
        return by_key[f"{automaton.name} {transition.key}"]

    def enabled(transition: Transition, slot: str) -> Expr:
        guard, info = Ref(f"work.guard_{slot}"), info_of(transition)
        return Binary("and", guard, is_over(info)) if info.timer else guard

    return Selection(
        verb="jump",
        taken=fired_variable,
        number=lambda transition: info_of(transition).number,
        enabled=enabled,
        moved=lambda t: (
            *of_mode(ends, automaton.source(t)),
            *forgotten(automaton, automaton.source(t)),
            *of_mode(begins, automaton.target(t)),
        ),
    )


def _jump(
    field: Field, mode: Mode, infos: tuple[TransitionInfo, ...], selection: Selection
) -> Block:
    guards = Run(f"guards_{mode.name}")
    if mode.beside:
        return (guards, *parallel_step(field, mode, selection))
    enabled: dict[int, Expr] = {}
    fired: dict[int, Block] = {}
    for k, (transition, info) in enumerate(
        zip(mode.transitions, infos_of(field.automaton, mode, infos), strict=True)
    ):
        enabled[k] = selection.enabled(transition, info.slot)
        fired[k] = (
            Assign("memory.fired", whole(info.number), info.key),
            *selection.moved(transition),
        )
    return (guards, *switch(field, mode, enabled, fired))


def _entries(
    field: Field, known: dict[str, Expr], waits: Waits, histories: tuple[History, ...]
) -> dict[str, Block]:
    automaton = field.automaton
    now = (*at_state(field), *at_time(field, real(0.0)))
    ends = [Assign(f"state.{name}", Ref(f"work.at_{name}")) for name in field.states]
    modes = automaton.modes.values()
    at_start = at_time(field, real(0.0))
    evaluate: Block = (*at_start, by_mode(field, "equations"))
    whole_known = {**known, **equation_names(automaton, "equation.")}
    # A delayed quantity may read another one: each round fills one more from what is inside it.
    rounds = (*evaluate, *fill_block(histories, whole_known))
    fill: Block = (Loop(len(histories), "work.round", rounds),) if histories else ()
    keep: Block = (*evaluate, *record_block(histories, whole_known), Assign(AGE.name, real(0.0)))
    record = {"record": keep} if histories else {}
    watch = tuple((mode.number, _watch(automaton, mode)) for mode in automaton.modes.values())
    begins = begun(waits)
    return {
        "derive": derive_block(automaton),
        "init": (
            Assign("memory.started", Value(False)),
            *enter_initial(automaton, "memory.mode"),
            Assign("memory.faults", whole(0)),
        ),
        "start": (
            *initial_ops(automaton, known, field.prefix),
            *enter_initial(automaton, "memory.mode"),
            *(wait.load for wait in waits),
            *forgotten(automaton),
            *(op for r in automaton.all_regions for op in of_mode(begins, r.modes[r.initial])),
            *((Assign(AGE.name, real(0.0)),) if histories else ()),
            Assign("memory.time", real(0.0)),
            Assign("memory.started", Value(True)),
            *entered(field, automaton.modes[automaton.initial], first_entry(automaton)),
            *fill,
        ),
        "equations": evaluate,
        **record,
        "watch": (*now, Choose("memory.mode", watch), Run("load")),
        "jump": (*none_fired(automaton), *now, by_mode(field, "jump")),
        "flow": (by_mode(field, "move"),),
        "dense": (Choose(field.mode, tuple((m.number, _dense(m)) for m in modes)),),
        "peek": (Run("point"), *ends),
    }


def _dense(mode: Mode) -> Block:
    """The polynomial of the flow that was just done, where no crossing was looked for on it."""
    run: Block = (Run(f"series_{mode.name}"),)
    is_known = Binary("or", Ref("work.crossed"), Ref("work.is_wait"))
    return (Branch(Unary("not", is_known), run),) if slots(mode) else run


def _watch(automaton: Automaton, mode: Mode) -> Block:
    armed = [Assign(f"memory.armed_{slot}", Ref(f"work.guard_{slot}")) for slot in slots(mode)]
    return (Run(f"guards_{mode.name}"), *armed, *settled(automaton))


def _remembered(automaton: Automaton) -> dict[str, Names]:
    """Return, by the key of a mode, what `after` and edges in its guards are."""
    alarms, edges = alarm_names(automaton), edge_names(automaton)
    return {mode.key: {**alarms[mode.key], **edges[mode.key]} for mode in automaton.all_modes}
