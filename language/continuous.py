"""Continuous: a continuous automaton as a Program that an engine moves from event to event.

Entries: `init` (start values from the inputs), `equations` (the values of now), `watch` (what each
guard is now), `jump` (one micro-step: `memory.fired` is the transition, 0 if none) and `flow`
(states over `work.h`, up to the first change of a guard, after `work.elapsed`).
"""

from __future__ import annotations

from language.constants import derive_block, parameter_constants
from language.field import Field, at_state, by_mode, enter, field_blocks, field_variables, jump
from language.lower import constant_names, equations
from language.model import Automaton, Mode
from language.motion import FLOW_HALVINGS, motion_blocks, motion_variables
from language.operation import (
    Assign,
    Binary,
    Block,
    Choose,
    Expr,
    Ref,
    Run,
    whole,
)
from language.problem import Problems
from language.program import Program, TransitionInfo, Variable
from language.rk4 import rk4
from language.transition import transition_infos
from language.wiring import (
    assembled,
    finished,
    initial_ops,
    input_variables,
    state_variables,
)

BETWEEN = ("work.h", "work.merge", "work.elapsed", "work.crossed")
"""What an engine sets before `flow` and reads after it."""
ENTRIES = ("init", "derive", "equations", "watch", "jump", "flow")


def continuous_program(automaton: Automaton, problems: Problems) -> Program:
    """Return the Program of a checked continuous automaton. Raises SpecError."""
    parameters = parameter_constants(automaton, problems)
    transitions = transition_infos(automaton, problems)
    inputs: dict[str, Expr] = {name: Ref(f"input.{name}") for name in automaton.inputs}
    states: dict[str, Expr] = {name: Ref(f"state.{name}") for name in automaton.states}
    known = {**constant_names(automaton), **inputs, **states}
    field = Field(automaton, known, inputs, "memory.mode", f"{automaton.name} ")
    method = rk4(field)
    armed = {k: f"memory.armed_{k}" for k in range(field.widest)}
    blocks = {
        **field_blocks(field),
        **method.blocks,
        **motion_blocks(field, method, Ref("work.merge"), FLOW_HALVINGS, lambda mode: armed),
    }
    for mode in automaton.modes.values():
        ops = equations(mode, dict(known), "equation.", field.prefix)
        blocks[f"equations_{mode.name}"] = tuple(ops)
        blocks[f"jump_{mode.name}"] = _jump(field, mode, transitions)
    blocks.update(_entries(automaton, field, known))
    problems.stop_if_any()
    constants = (*parameters.values(), *method.constants)
    variables = [*_variables(automaton, field), *motion_variables(field, method)]
    program = assembled(automaton, blocks, constants, variables, transitions)
    return finished(program, ENTRIES, keep=BETWEEN)


def _variables(automaton: Automaton, field: Field) -> list[Variable]:
    return [
        *input_variables(automaton, "input"),
        *state_variables(automaton),
        Variable("memory.mode", "whole", about="active mode"),
        Variable("memory.fired", "whole", about="transition of this micro-step, 0: none"),
        *(Variable(f"memory.armed_{k}", "truth") for k in range(field.widest)),
        *(Variable(f"memory.due_{k}", "truth") for k in range(field.widest)),
        *_reset_variables(automaton),
        *field_variables(field),
        Variable("work.merge", "real", "s", about="what crosses within it is one instant"),
    ]


def _reset_variables(automaton: Automaton) -> list[Variable]:
    found = {
        name: Variable(f"work.reset_{name}", "real", str(automaton.states[name].unit.dimension))
        for mode in automaton.modes.values()
        for transition in mode.transitions
        for name in transition.reset
    }
    return list(found.values())


def _jump(field: Field, mode: Mode, infos: tuple[TransitionInfo, ...]) -> Block:
    own = [info for info in infos if info.source == mode.number]
    enabled: dict[int, Expr] = {}
    fire: dict[int, Block] = {}
    for k, transition in enumerate(mode.transitions):
        guard = Ref(f"work.guard_{k}")
        due = Ref(f"memory.due_{k}")
        enabled[k] = Binary("and", guard, due) if own[k].timer else guard
        number = Assign("memory.fired", whole(own[k].number), own[k].key)
        fire[k] = (enter(field, transition), number)
    return (Run(f"guards_{mode.name}"), *jump(field, mode, enabled, fire))


def _entries(automaton: Automaton, field: Field, known: dict[str, Expr]) -> dict[str, Block]:
    initial = automaton.modes[automaton.initial]
    watch = tuple((mode.number, _watch(mode)) for mode in automaton.modes.values())
    return {
        "derive": derive_block(automaton),
        "init": (
            *initial_ops(automaton, known, field.prefix),
            Assign("memory.mode", whole(initial.number)),
        ),
        "equations": (by_mode(field, "equations"),),
        "watch": (*at_state(field), Choose("memory.mode", watch)),
        "jump": (Assign("memory.fired", whole(0)), *at_state(field), by_mode(field, "jump")),
        "flow": (by_mode(field, "move"),),
    }


def _watch(mode: Mode) -> Block:
    guards = range(len(mode.transitions))
    armed = [Assign(f"memory.armed_{k}", Ref(f"work.guard_{k}")) for k in guards]
    return (Run(f"guards_{mode.name}"), *armed)
