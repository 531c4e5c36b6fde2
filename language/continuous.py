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
from collections.abc import Collection, Mapping

from language.action import discrete_variables
from language.constants import parameter_constants, values_of
from language.field import (
    Field,
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
    histories_of,
    history_variables,
)
from language.integration import method_of
from language.invariant import INVARIANTS, invariant_block, invariant_variables
from language.linear import Point
from language.lower import Names, equations, variable_names
from language.model import Automaton, Mode, Transition
from language.motion import FLOW_HALVINGS, Method, motion_blocks, motion_variables
from language.operation import (
    Assign,
    Binary,
    Block,
    Expr,
    Ref,
    Run,
    add,
    multiply,
    whole,
)
from language.parallel import Selection, parallel_blocks, parallel_step
from language.parameter import constant_names
from language.part import parts_block
from language.problem import Problems
from language.program import MotionLimit, Program, TransitionInfo, Variable, fired_variable
from language.region import in_modes
from language.stepping import (
    BETWEEN,
    LIVELOCK,
    ZENO,
    Waits,
    begun,
    ended,
    is_over,
    of_mode,
    step_block,
    stepping_blocks,
    stepping_variables,
    waits_of,
)
from language.transition import infos_of, transition_infos
from language.turning import edge_names, forgotten, level_variables
from language.wiring import (
    assembled,
    finished,
    input_variables,
    mode_and_fired,
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
    histories, alarms = histories_of(automaton), alarms_of(automaton)
    known = _known(automaton, histories)
    field = _field(automaton, known, varying, bool(histories))
    flows = field_blocks(field)
    point = Point(automaton, values_of(parameters), {})
    method, info = method_of(
        automaton.method, field, flows, point, automaton.step, automaton.span, problems
    )
    waits = waits_of(transitions, alarms)
    blocks = {
        **flows,
        **_motion(field, method, flows),
        **stepping_blocks(field, waits, (AGE.name,) if histories else ()),
        **_in_modes(field, known, transitions, _selection(automaton, transitions, waits)),
        **invariant_block(automaton, known),
        **parts_block(field, known, waits, histories),
    }
    blocks["step"] = step_block(field, bool(histories), blocks)
    problems.stop_if_any()
    variables = [*_variables(automaton, field), *stepping_variables(field, waits)]
    variables += motion_variables(field, method)
    variables += [Variable(name, "real") for name in _courses(varying)]
    variables += history_variables(histories)
    variables += [Variable(alarm.variable, "truth") for alarm in alarms]
    constants = (*parameters.values(), *method.constants)
    program = assembled(automaton, blocks, constants, variables, transitions)
    program = dataclasses.replace(program, motion=info, faults=(ZENO, LIVELOCK))
    entries = (*(ENTRIES if not varying else ENTRIES[:2]), *PARTS)
    return finished(program, entries, keep=(*BETWEEN, *_courses(varying)))


def step_limits(automaton: Automaton) -> tuple[MotionLimit, ...]:
    """Return the largest stable step of each mode that has one, whatever the step is."""
    problems = Problems()
    histories = histories_of(automaton)
    field = _field(automaton, _known(automaton, histories), (), bool(histories))
    point = Point(automaton, values_of(parameter_constants(automaton, problems)), {})
    place = (automaton.step, automaton.span, problems)
    return method_of(automaton.method, field, field_blocks(field), point, *place)[1].limits


def _known(automaton: Automaton, histories: tuple[History, ...]) -> Names:
    return {
        **constant_names(automaton),
        **variable_names(automaton, "before"),
        **in_modes(automaton, "memory.mode"),
        **delayed(automaton, histories),
    }


def _field(
    automaton: Automaton, known: Names, varying: Collection[str], has_history: bool
) -> Field:
    held = {name: known[name] for name in automaton.inputs}
    return Field(
        automaton,
        known,
        {**held, **{name: _parabola(name) for name in varying}},
        "memory.mode",
        f"{automaton.name} ",
        bool(varying or has_history),
        _remembered(automaton),
    )


def _motion(field: Field, method: Method, flows: Mapping[str, Block]) -> dict[str, Block]:
    """The flow of each mode up to the first change of a guard, by the method's steps."""
    armed = {slot: f"memory.armed_{slot}" for slot in field.slots}
    halvings = FLOW_HALVINGS[field.automaton.numbers]
    merge, is_wait = Ref("work.merge"), Ref("work.is_wait")
    moves = motion_blocks(field, method, flows, merge, halvings, lambda mode: armed, is_wait)
    return {**method.blocks, **moves}


def _in_modes(
    field: Field, known: Names, infos: tuple[TransitionInfo, ...], selection: Selection
) -> dict[str, Block]:
    """What each mode evaluates, and where it goes."""
    blocks: dict[str, Block] = {}
    for mode in field.automaton.modes.values():
        ops = equations(mode, dict(known), "equation.", field.prefix)
        blocks[f"equations_{mode.name}"] = tuple(ops)
        blocks[f"jump_{mode.name}"] = _jump(field, mode, infos, selection)
    if field.automaton.regions:
        blocks.update(parallel_blocks(field, selection))
    return blocks


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


def _remembered(automaton: Automaton) -> dict[str, Names]:
    """Return, by the key of a mode, what `after` and edges in its guards are."""
    alarms, edges = alarm_names(automaton), edge_names(automaton)
    return {mode.key: {**alarms[mode.key], **edges[mode.key]} for mode in automaton.all_modes}
