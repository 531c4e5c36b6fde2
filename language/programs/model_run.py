"""Runs of the model inside a tick, which follow the model's located transitions (rule 2c).

Blocks: those of the model's vector field and method, `switch_<mode>` (one micro-step of the model)
and, for each mode of the automaton with a run, `run_<mode>`: the period, segment by segment, with
at most `events` jumps in each substep.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from language.integration.crossing_location import (
    RUN_BISECTIONS,
    continuous_step_blocks,
    continuous_step_variables,
)
from language.integration.method_selection import build_method
from language.integration.vector_field import (
    VectorField,
    field_blocks,
    field_variables,
    run_block_by_mode,
    set_point_to_state,
)
from language.ir.number_type import round_to_type
from language.ir.ops import (
    Assign,
    Block,
    Branch,
    Compare,
    Expr,
    FaultBit,
    Loop,
    Op,
    Ref,
    RunBlock,
    Value,
    integer,
    real,
    subtract,
)
from language.ir.program import Constant, IntegrationInfo, Variable, mode_variable
from language.ir.root_region import CHART
from language.lowering.delay_buffers import find_memory_call
from language.lowering.event_tolerance import merge_time
from language.lowering.expressions import variable_bindings
from language.lowering.guard_variable_names import guard_slot
from language.lowering.linearisation import LinearisationPoint, linearise_model
from language.lowering.program_builder import enter_initial_modes
from language.lowering.program_parameters import cast_to_type, constant_bindings
from language.lowering.range_saturation import saturate_written_states
from language.lowering.transition_choice import without_last_test
from language.model.automaton import Automaton, Mode, ModelRun
from language.model.constant_states import written_states
from language.numerics.evaluate import Scalar
from language.programs.continuous_micro_step import TransitionSelection, micro_step_blocks
from language.text.diagnostic import Problems

EVENT_LIMIT = "event_limit"
"""The fault bit of a run with more events than allowed."""
RUN_MODE = "memory.run_mode"
"""The variable of the mode of the run."""
SATURATION_BLOCK = "saturate_states"
"""The block that holds the states of a run in their ranges."""
STEP_DIVIDING_METHODS = ("midpoint", "rk4")
"""Methods whose polynomial divides by the step.

A very short step would give coefficients of any size.
"""
MIN_REMAINDER = Fraction(1, 2**60)
"""The smallest rest of a substep that is integrated, in periods.

The rest after a crossing is 0 or at least 2^-25 of its step (`RUN_BISECTIONS`), so after two
crossings it is 0 or above this limit.
"""


@dataclass(frozen=True)
class RunStep:
    """The blocks, variables, constants and method that all runs of an automaton share."""

    blocks: dict[str, Block]
    variables: tuple[Variable, ...]
    constants: tuple[Constant, ...]
    info: IntegrationInfo


def build_run_step(
    automaton: Automaton, runs: list[ModelRun], values: Mapping[str, Scalar], problems: Problems
) -> RunStep:
    """Return the integration of the model inside a tick; `values` are those of the constants.

    Method, substeps and linearisation are those of the first run. Reported are runs with different
    settings, a model with actions, with discrete variables or with waits, inputs without a value,
    and what the method reports. Raises SpecError if the model uses a function with memory.
    """
    model = automaton.model
    assert model and automaton.period is not None
    held = tuple(saturate_written_states(automaton, written_states(model))[1])
    first = runs[0]
    _require_equal_settings(runs, problems)
    point = LinearisationPoint(automaton, values, {})
    if first.linearise is not None:
        model = linearise_model(model, first, point, problems)
    inputs = _input_bindings(automaton, problems)
    _refuse_memory(model, problems)
    _refuse_actions(automaton, model, problems)
    field = VectorField(
        model,
        constant_bindings(automaton),
        inputs,
        RUN_MODE,
        f"{model.name} ",
        has_stage_blocks=automaton.numbers == "float64",
    )
    blocks = field_blocks(field)
    h = automaton.period / first.substeps
    place = first.method_span or first.span
    method, info = build_method(first.method, field, blocks, point, h, place, problems)
    events = max(run.events if run.follow else 0 for run in runs)
    merge = real(merge_time(automaton.numbers, automaton.period))
    all_blocks = {
        **blocks,
        **method.blocks,
        **continuous_step_blocks(field, method, blocks, merge, RUN_BISECTIONS, lambda mode: None),
    }
    all_blocks.update(_switch_blocks(field, problems))
    if first.method in STEP_DIVIDING_METHODS and held:
        all_blocks[SATURATION_BLOCK] = held
    variables = (
        *_run_variables(model),
        *field_variables(field),
        *continuous_step_variables(field, method),
    )
    info = dataclasses.replace(info, max_events=events)
    return RunStep(all_blocks, variables, method.constants, info)


def _run_variables(model: Automaton) -> tuple[Variable, ...]:
    """Return the variables of the modes and of the segments of a run."""
    return (
        *_mode_variables(model),
        Variable("work.left", "real", "s", about="rest of the tick, or of its substep"),
        Variable("work.piece", "whole"),
        Variable("work.substep", "whole"),
    )


def _refuse_memory(model: Automaton, problems: Problems) -> None:
    """Raise SpecError if the model uses a function with memory."""
    call = find_memory_call(model)
    if call:
        label = "the model of a run inside a tick cannot use a function with memory"
        problems.error("run", call.span, label)
        problems.raise_if_errors()


def _require_equal_settings(runs: list[ModelRun], problems: Problems) -> None:
    """Report each run whose method, substeps or linearisation differ from the first run's."""
    for run in runs:
        if _settings_key(run) != _settings_key(runs[0]):
            label = "all runs of an automaton have one method, one number of substeps and one point"
            problems.error("run", run.span, label)


def run_block(automaton: Automaton, run: ModelRun, duration: Expr | None = None) -> Block:
    """Return the advance of a mode that runs the model over a period, through its events.

    Without `follow` the flow of one mode is integrated and no guard is tested. `duration`, a part
    of the period [s], replaces the substep; the run should then have one substep. States are held
    in their ranges at the end or, with `follow` and STEP_DIVIDING_METHODS, after each segment.
    """
    model = automaton.model
    assert model and automaton.period is not None
    field = VectorField(model, {}, {}, RUN_MODE, "")
    length = real(automaton.period / run.substeps) if duration is None else duration
    before, held = saturate_moved_states(automaton, run.method, written_states(model))
    inside, outside = (
        (held, ()) if run.follow and run.method in STEP_DIVIDING_METHODS else ((), held)
    )
    if run.follow:
        body = _substep_with_events(automaton, field, run, length, inside)
    else:
        body = _substep_without_events(automaton, field, run, length)
    moved: Block = body if run.substeps == 1 else (Loop(run.substeps, "work.substep", body),)
    return (*before, *moved, *outside)


def saturate_moved_states(
    automaton: Automaton, method: str, names: Sequence[str]
) -> tuple[Block, Block]:
    """Return the operations before and after code that integrates states of the model.

    They hold the states `names` in their ranges. STEP_DIVIDING_METHODS use the shared block
    `saturate_states`, which holds all states that the model writes.
    """
    assert automaton.model
    is_shared = method in STEP_DIVIDING_METHODS
    before, after = saturate_written_states(
        automaton, written_states(automaton.model) if is_shared else names
    )
    return tuple(before), (RunBlock(SATURATION_BLOCK),) if is_shared and after else tuple(after)


def _substep_with_events(
    automaton: Automaton, field: VectorField, run: ModelRun, length: Expr, held: Block
) -> Block:
    """Return one substep, segment by segment, with at most `events` jumps.

    `held` follows each segment. The jump after that ends the substep and sets a fault bit.
    """
    assert automaton.period is not None
    may_jump = Compare("<", Ref("work.piece"), integer(run.events))
    at_limit: Block = (FaultBit(EVENT_LIMIT), Assign("work.left", real(0.0)))
    look = (*set_point_to_state(field), run_block_by_mode(field, "guards"))
    after: Block = (Branch(may_jump, (*look, run_block_by_mode(field, "switch")), at_limit),)
    segment: Block = (
        Assign("work.h", Ref("work.left")),
        run_block_by_mode(field, "flow"),
        *held,
        Assign("work.left", subtract(Ref("work.left"), Ref("work.elapsed"))),
        Branch(Ref("work.crossed"), after),
    )
    least = automaton.period * MIN_REMAINDER if run.method in STEP_DIVIDING_METHODS else Fraction(0)
    left = Compare(">", Ref("work.left"), real(least))
    return (
        Assign("work.left", length, f"{automaton.name} {run.key}"),
        Loop(run.events + 1, "work.piece", (Branch(left, segment),)),
    )


def _refuse_actions(automaton: Automaton, model: Automaton, problems: Problems) -> None:
    """Report a model with discrete variables, entry or exit actions, which a run cannot carry."""
    acting = any(mode.has_entry_or_exit for mode in model.all_modes)
    if model.discrete or acting:
        what = "discrete variables" if model.discrete else "entry or exit actions"
        label = f"a run inside a tick carries states alone: `{model.name}` has {what}"
        problems.error("run", automaton.span, label)


def _input_bindings(automaton: Automaton, problems: Problems) -> dict[str, Expr]:
    """Return the expressions of the model's inputs.

    They are the inputs of the previous tick, or the default of an input that the automaton lacks.
    An input with neither is reported.
    """
    model = automaton.model
    assert model
    found: dict[str, Expr] = {}
    for name, thing in model.inputs.items():
        found[name] = real(0.0)
        if name in automaton.inputs:
            found[name] = variable_bindings(automaton, "before")[name]
        elif thing.default is not None:
            found[name] = Value(cast_to_type(round_to_type(thing.default), thing.type))
        else:
            label = f"the run needs an input `{name}`: `{model.name}` has no default for it"
            problems.error("run", automaton.span, label)
    return found


def _substep_without_events(
    automaton: Automaton, field: VectorField, run: ModelRun, length: Expr
) -> Block:
    """Return one substep by the flow of one mode, without a test of guards."""
    ends = [Assign(f"state.{name}", Ref(f"work.end_{name}")) for name in field.states]
    step = RunBlock(f"step_{run.mode}")
    return (Assign("work.h", length, f"{automaton.name} {run.key}"), step, *ends)


def _settings_key(run: ModelRun) -> tuple[object, ...]:
    """Return the settings that all runs of an automaton must share, as a comparable key."""
    at = {name: formula.tree for name, formula in (run.linearise or {}).items()}
    return run.method, run.substeps, run.linearise is None, at


def _switch_blocks(field: VectorField, problems: Problems) -> dict[str, Block]:
    """Return `switch_<mode>`, one micro-step of the model; a transition with a wait is reported."""
    model = field.automaton
    for transition in model.all_transitions:
        if transition.wait:
            label = "a run inside a tick follows transitions without a wait only"
            problems.error("run", transition.wait.span, label)
    keys = [transition.key for transition in model.all_transitions]

    def enabled(mode: Mode) -> dict[int, Expr]:
        """Return the guards of a mode.

        A located crossing has a true guard, so without parallel regions one of them is true.
        """
        slots = [guard_slot(mode.region, k) for k in range(len(mode.transitions))]
        guards: dict[int, Expr] = {k: Ref(f"work.guard_{slot}") for k, slot in enumerate(slots)}
        return guards if model.regions else without_last_test(mode, guards)

    selection = TransitionSelection(
        block_prefix="switch",
        selected_variable=lambda region: f"work.taken_{region}",
        number_of=lambda transition: keys.index(transition.key) + 1,
        enabled=enabled,
        after_switch=lambda transition: (),
    )
    return micro_step_blocks(field, selection)


def _mode_variables(model: Automaton) -> list[Variable]:
    """Return the variables of the mode and of the selected transition of each region."""
    found = []
    for region in model.all_regions:
        where = "" if region.name == CHART else f", region {region.name}"
        about = f"mode of the run of {model.name}{where}"
        found.append(Variable(mode_variable(RUN_MODE, region.name), "whole", about=about))
        found.append(Variable(f"work.taken_{region.name}", "whole"))
    return found


def start_run_regions(model: Automaton) -> list[Op]:
    """Return the assignments that set the parallel regions of a run's model to their initial modes.

    The chart is left out: a run enters a mode of it, and the parallel regions continue from tick to
    tick.
    """
    return [op for op in enter_initial_modes(model, RUN_MODE) if op.target != RUN_MODE]
