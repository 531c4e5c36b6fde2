"""Lowering of a continuous automaton to a Program that advances from event to event.

The block `step` is one major step (language/programs/major_step.py); with `init` and `derive` it is
the C code. An engine runs its parts instead:

    start        start values from the inputs
    equations    the present values of the equations
    watch        the present guards, stored
    jump         one micro-step; `memory.fired` is the transition, 0 if none
    flow         states over `work.h` or up to the first crossing, after `work.elapsed`
    dense        the polynomial of the last flow
    peek         with the states of the start of that flow: the states `work.s` after it

`dense` and `peek` use the dense output of the method (Hairer, Norsett, Wanner, Solving Ordinary
Differential Equations I, II.6).

Inputs that are constant over a step are `before.u`; `latch` copies the present ones at its end. An
input that varies inside a step is `before.u + s (work.rise_u + s work.bend_u)` at the time s of the
step: a parabola through its values at the ends and the middle, which are the stage times of RK4.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping

from language.integration.crossing_location import (
    FLOW_BISECTIONS,
    IntegrationMethod,
    continuous_step_blocks,
    continuous_step_variables,
)
from language.integration.method_selection import build_method
from language.integration.vector_field import (
    VectorField,
    field_blocks,
    field_variables,
)
from language.ir.ops import Assign, Binary, Block, Expr, Ref, RunBlock, add, integer, multiply
from language.ir.program import (
    ENGINE_BLOCKS,
    ENTRY_BLOCKS,
    STEP_INTERFACE,
    Program,
    StabilityLimit,
    TransitionInfo,
    Variable,
    fired_variable,
)
from language.lowering.action_stages import discrete_variables
from language.lowering.constants import constant_values, parameter_constants
from language.lowering.continuous_delay import (
    RECORD_AGE,
    ContinuousDelay,
    alarm_bindings,
    alarms_of,
    continuous_delay_variables,
    continuous_delays_of,
    delayed_value_bindings,
)
from language.lowering.continuous_edge_detection import edge_bindings, level_variables, reset_levels
from language.lowering.expressions import NameBindings, lower_equations, variable_bindings
from language.lowering.guard_variable_names import mode_bindings
from language.lowering.invariants import invariant_blocks, invariant_variables
from language.lowering.linearisation import LinearisationPoint
from language.lowering.program_builder import (
    assemble_program,
    finalise_program,
    input_variables,
    region_variables,
    state_variables,
)
from language.lowering.program_parameters import constant_bindings
from language.lowering.transition_metadata import transition_infos
from language.model.automaton import Automaton, Mode, Transition
from language.programs.continuous_micro_step import TransitionSelection, micro_step_blocks
from language.programs.engine_blocks import engine_blocks
from language.programs.major_step import (
    LIVELOCK,
    ZENO,
    WaitTimers,
    begin_blocks,
    block_of_mode,
    end_blocks,
    is_wait_over,
    major_step_block,
    major_step_blocks,
    major_step_variables,
    wait_timers_of,
)
from language.text.diagnostic import Problems


def lower_continuous_automaton(
    automaton: Automaton, problems: Problems, varying_inputs: Collection[str] = ()
) -> Program:
    """Return the Program of a checked continuous automaton.

    `varying_inputs` names the inputs that change inside a step; with any of them the Program has no
    block `step`. Fault bits are `zeno` and `livelock`. Raises SpecError if `problems` has an error,
    also an earlier one.
    """
    parameters = parameter_constants(automaton, problems)
    transitions = transition_infos(automaton, problems)
    histories, alarms = continuous_delays_of(automaton), alarms_of(automaton)
    known = _base_bindings(automaton, histories)
    field = _vector_field(automaton, known, varying_inputs, bool(histories))
    flows = field_blocks(field)
    point = LinearisationPoint(automaton, constant_values(parameters), {})
    method, info = build_method(
        automaton.method, field, flows, point, automaton.step, automaton.span, problems
    )
    waits = wait_timers_of(transitions, alarms)
    blocks = {
        **flows,
        **_continuous_step(field, method, flows),
        **major_step_blocks(field, waits, (RECORD_AGE.name,) if histories else ()),
        **_mode_blocks(field, known, _selection(automaton, transitions, waits)),
        **invariant_blocks(automaton, known),
        **engine_blocks(field, known, waits, histories),
    }
    blocks["step"] = major_step_block(field, bool(histories), blocks)
    problems.raise_if_errors()
    variables = [*_variables(automaton, field), *major_step_variables(waits)]
    variables += continuous_step_variables(field, method)
    variables += [Variable(name, "real") for name in _parabola_variables(varying_inputs)]
    variables += continuous_delay_variables(histories)
    variables += [Variable(alarm.variable, "truth") for alarm in alarms]
    constants = (*parameters.values(), *method.constants)
    program = assemble_program(automaton, blocks, constants, variables, transitions)
    program = dataclasses.replace(program, integration=info, faults=(ZENO, LIVELOCK))
    entries = (*(ENTRY_BLOCKS if not varying_inputs else ENTRY_BLOCKS[:2]), *ENGINE_BLOCKS)
    return finalise_program(
        program, entries, keep=(*STEP_INTERFACE, *_parabola_variables(varying_inputs))
    )


def stable_step_limits(automaton: Automaton) -> tuple[StabilityLimit, ...]:
    """Return the largest stable step of each mode that has a limit.

    Modes without a decaying component, and exponential methods, have none. Nothing is reported.
    """
    problems = Problems()
    histories = continuous_delays_of(automaton)
    field = _vector_field(automaton, _base_bindings(automaton, histories), (), bool(histories))
    point = LinearisationPoint(
        automaton, constant_values(parameter_constants(automaton, problems)), {}
    )
    place = (automaton.step, automaton.span, problems)
    return build_method(automaton.method, field, field_blocks(field), point, *place)[
        1
    ].stability_limits


def _base_bindings(automaton: Automaton, delays: tuple[ContinuousDelay, ...]) -> NameBindings:
    """Return the expressions of parameters, variables, modes and delayed values by name."""
    return {
        **constant_bindings(automaton),
        **variable_bindings(automaton, "before"),
        **mode_bindings(automaton, "memory.mode"),
        **delayed_value_bindings(automaton, delays),
    }


def _vector_field(
    automaton: Automaton, known: NameBindings, varying_inputs: Collection[str], has_history: bool
) -> VectorField:
    """Return the vector field of the automaton; varying inputs are parabolas in `work.s`."""
    held = {name: known[name] for name in automaton.inputs}
    return VectorField(
        automaton,
        known,
        {**held, **{name: _input_parabola(name) for name in varying_inputs}},
        "memory.mode",
        f"{automaton.name} ",
        bool(varying_inputs or has_history),
        _guard_memory(automaton),
    )


def _continuous_step(
    field: VectorField, method: IntegrationMethod, flows: Mapping[str, Block]
) -> dict[str, Block]:
    """Return the blocks of the method and of the steps up to the first crossing."""
    armed = {slot: f"memory.armed_{slot}" for slot in field.guard_slots}
    halvings = FLOW_BISECTIONS[field.automaton.numbers]
    merge, is_wait = Ref("work.merge"), Ref("work.is_wait")
    moves = continuous_step_blocks(
        field, method, flows, merge, halvings, lambda mode: armed, is_wait
    )
    return {**method.blocks, **moves}


def _mode_blocks(
    field: VectorField,
    known: NameBindings,
    selection: TransitionSelection,
) -> dict[str, Block]:
    """Return `equations_<mode>` and `jump_<mode>` of each mode, and those of parallel regions."""
    steps, blocks = micro_step_blocks(field, selection), dict[str, Block]()
    for mode in field.automaton.modes.values():
        ops = lower_equations(mode, dict(known), "equation.", field.key_prefix)
        blocks[f"equations_{mode.name}"] = tuple(ops)
        step = steps.pop(f"jump_{mode.name}")
        blocks[f"jump_{mode.name}"] = (RunBlock(f"guards_{mode.name}"), *step)
    return blocks | steps


def _input_parabola(name: str) -> Expr:
    """Return the value of a varying input at `work.s`."""
    s, bend = Ref("work.s"), Ref(f"work.bend_{name}")
    inner = add(Ref(f"work.rise_{name}"), multiply(s, bend))
    return add(Ref(f"before.{name}"), multiply(s, inner))


def _parabola_variables(varying_inputs: Collection[str]) -> list[str]:
    """Return the variables of the coefficients of the varying inputs."""
    return [f"work.{part}_{name}" for name in varying_inputs for part in ("rise", "bend")]


def _variables(automaton: Automaton, field: VectorField) -> list[Variable]:
    """Return the variables of the automaton and of its vector field."""
    return [
        *input_variables(automaton, "input"),
        *state_variables(automaton),
        *input_variables(automaton, "before"),
        *region_variables(automaton, "micro-step"),
        *(Variable(f"memory.armed_{slot}", "truth") for slot in field.guard_slots),
        *discrete_variables(automaton),
        *invariant_variables(automaton),
        *field_variables(field),
        *level_variables(automaton),
        Variable("work.merge", "real", "s", about="what crosses within it is one instant"),
    ]


def _selection(
    automaton: Automaton, infos: tuple[TransitionInfo, ...], waits: WaitTimers
) -> TransitionSelection:
    """Return how a micro-step selects transitions; a wait must be over for its transition.

    After a transition the timers and edges of the source are reset and those of the target start.
    Without parallel regions the number of the transition is stored then.
    """
    by_key = {info.key: info for info in infos}
    begins, ends = begin_blocks(waits), end_blocks(waits)

    def info_of(transition: Transition) -> TransitionInfo:
        """Return the data of a transition."""
        return by_key[f"{automaton.name} {transition.key}"]

    def enabled(mode: Mode) -> dict[int, Expr]:
        """Return the conditions of transitions: the guard and the end of the wait, if any."""
        found: dict[int, Expr] = {}
        for k, info in enumerate(map(info_of, mode.transitions)):
            guard = Ref(f"work.guard_{info.slot}")
            found[k] = Binary("and", guard, is_wait_over(info)) if info.timer else guard
        return found

    def fire(transition: Transition) -> Block:
        """Return the operations after the change of mode."""
        info = info_of(transition)
        fired = Assign(fired_variable(info.region), integer(info.number), info.key)
        return (
            *(() if automaton.regions else (fired,)),
            *block_of_mode(ends, automaton.source_mode(transition)),
            *reset_levels(automaton, automaton.source_mode(transition)),
            *block_of_mode(begins, automaton.target_mode(transition)),
        )

    return TransitionSelection(
        block_prefix="jump",
        selected_variable=fired_variable,
        number_of=lambda transition: info_of(transition).number,
        enabled=enabled,
        after_switch=fire,
    )


def _guard_memory(automaton: Automaton) -> dict[str, NameBindings]:
    """Return the conditions of `after`, `every` and edges, by key path of mode, then memory key."""
    alarms, edges = alarm_bindings(automaton), edge_bindings(automaton)
    return {mode.key: {**alarms[mode.key], **edges[mode.key]} for mode in automaton.all_modes}
