"""Run: a mode of the model inside a tick, following the model's own located transitions (rule 2c).

Blocks: those of the model's field and motion, `switch_<mode>` (one of its transitions), and for a
mode of ours that runs, `run_<mode>`: the period, segment by segment, at most `events` jumps.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from language.expressions.syntax_tree import structural_key
from language.integration.crossing_location import (
    RUN_BISECTIONS,
    continuous_step_blocks,
    continuous_step_variables,
    merge_time,
)
from language.integration.method_selection import build_method
from language.integration.vector_field import (
    ALWAYS,
    VectorField,
    field_blocks,
    field_variables,
    lower_single_region_step,
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
from language.ir.regions import CHART
from language.lowering.delay_buffers import find_memory_call
from language.lowering.expressions import variable_bindings
from language.lowering.linearisation import LinearisationPoint, linearise_model
from language.lowering.parameter_bindings import cast_to_type, constant_bindings
from language.lowering.program_builder import enter_initial_modes
from language.lowering.range_saturation import saturate_written_states
from language.model.automaton import Automaton, Mode, ModelRun
from language.model.constant_states import written_states
from language.model.region_queries import transitions_by_priority
from language.numerics.evaluate import Scalar
from language.programs.parallel_regions import (
    TransitionSelection,
    lower_parallel_step,
    parallel_blocks,
)
from language.text.diagnostic import Problems

EVENT_LIMIT = "event_limit"
RUN_MODE = "memory.run_mode"
SATURATION_BLOCK = "hold"
STEP_DIVIDING_METHODS = ("midpoint", "rk4")
"""Methods with a polynomial that divides by the step: of a short one it may be of any size."""
MIN_REMAINDER = Fraction(1, 2**60)
"""Periods. The rest after a crossing that is no end is at least 2^-25 of its step (`RUN_HALVINGS`):
two crossings leave more than this, or nothing.
"""


@dataclass(frozen=True)
class RunStep:
    """What the runs of an automaton share."""

    blocks: dict[str, Block]
    variables: tuple[Variable, ...]
    constants: tuple[Constant, ...]
    info: IntegrationInfo


def build_run_step(
    automaton: Automaton, runs: list[ModelRun], values: Mapping[str, Scalar], problems: Problems
) -> RunStep:
    """Return the motion of the model inside a tick; `values` are those of the constants."""
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
    made = {
        **blocks,
        **method.blocks,
        **continuous_step_blocks(field, method, blocks, merge, RUN_BISECTIONS, lambda mode: None),
    }
    made.update(_switch_blocks(field, problems))
    made.update({SATURATION_BLOCK: held} if first.method in STEP_DIVIDING_METHODS and held else {})
    variables = (
        *_run_variables(model),
        *field_variables(field),
        *continuous_step_variables(field, method),
    )
    return RunStep(made, variables, method.constants, dataclasses.replace(info, max_events=events))


def _run_variables(model: Automaton) -> tuple[Variable, ...]:
    return (
        *_mode_variables(model),
        Variable("work.left", "real", "s", about="rest of the tick, or of its substep"),
        Variable("work.piece", "whole"),
        Variable("work.substep", "whole"),
    )


def _refuse_memory(model: Automaton, problems: Problems) -> None:
    remembering = find_memory_call(model)
    if remembering:
        label = "a run inside a tick follows what has no memory"
        problems.error("run", remembering.span, label)
        problems.raise_if_errors()


def _require_equal_settings(runs: list[ModelRun], problems: Problems) -> None:
    for run in runs:
        if _settings_key(run) != _settings_key(runs[0]):
            label = "all runs of an automaton have one method, one number of substeps and one point"
            problems.error("run", run.span, label)


def run_block(automaton: Automaton, run: ModelRun, duration: Expr | None = None) -> Block:
    """Return the advance of a mode that runs the model: the whole period, through its events.

    Or `duration`, a part of the period [s]: then the run has one substep.
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
    """Return what stands before and after operations that move some states of the model: they are
    held in their ranges, by the block of all runs where there is one.
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
    """One substep, segment by segment, at most `events` jumps; states are `held` after each."""
    assert automaton.period is not None
    may_jump = Compare("<", Ref("work.piece"), integer(run.events))
    at_limit: Block = (FaultBit(EVENT_LIMIT), Assign("work.left", real(0.0)))
    look = (*set_point_to_state(field), run_block_by_mode(field, "guards"))
    after: Block = (Branch(may_jump, (*look, run_block_by_mode(field, "switch")), at_limit),)
    segment: Block = (
        Assign("work.h", Ref("work.left")),
        run_block_by_mode(field, "move"),
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
    """A run starts with our states: what its model would do at its own start has no place."""
    acting = any(mode.entry or mode.exit for mode in model.all_modes)
    if model.discrete or acting:
        what = "discrete variables" if model.discrete else "entry or exit actions"
        label = f"a run inside a tick carries states alone: `{model.name}` has {what}"
        problems.error("run", automaton.span, label)


def _input_bindings(automaton: Automaton, problems: Problems) -> dict[str, Expr]:
    """A run reads the inputs of the tick before; what is no input here has its default."""
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
    """One substep in the flow of one mode: no guard of the model is looked at."""
    ends = [Assign(f"state.{name}", Ref(f"work.end_{name}")) for name in field.states]
    step = RunBlock(f"step_{run.mode}")
    return (Assign("work.h", length, f"{automaton.name} {run.key}"), step, *ends)


def _settings_key(run: ModelRun) -> tuple[object, ...]:
    at = {name: structural_key(formula.tree) for name, formula in (run.linearise or {}).items()}
    return run.method, run.substeps, run.linearise is None, at


def _switch_blocks(field: VectorField, problems: Problems) -> dict[str, Block]:
    """Return `switch_<mode>`: one micro-step of the run's model."""
    model = field.automaton
    for mode in model.all_modes:
        for transition in mode.transitions:
            if transition.wait:
                label = "a run inside a tick follows transitions without a wait only"
                problems.error("run", transition.wait.span, label)
    if not model.regions:
        return {f"switch_{mode.name}": _switch_block(field, mode) for mode in model.modes.values()}
    keys = [transition.key for mode in model.all_modes for transition in mode.transitions]
    selection = TransitionSelection(
        block_prefix="switch",
        selected_variable=lambda region: f"work.taken_{region}",
        number_of=lambda transition: keys.index(transition.key) + 1,
        enabled_condition=lambda transition, slot: Ref(f"work.guard_{slot}"),
        after_switch=lambda transition: (),
    )
    blocks = parallel_blocks(field, selection)
    for mode in model.modes.values():
        blocks[f"switch_{mode.name}"] = lower_parallel_step(field, mode, selection)
    return blocks


def _switch_block(field: VectorField, mode: Mode) -> Block:
    """A crossing is located where a guard is true: if none of the others is, the last one is."""
    enabled: dict[int, Expr] = {k: Ref(f"work.guard_{k}") for k in range(len(mode.transitions))}
    for k, _ in transitions_by_priority(mode)[-1:]:
        enabled[k] = ALWAYS
    return lower_single_region_step(field, mode, enabled, {})


def _mode_variables(model: Automaton) -> list[Variable]:
    """Return the variables of the modes of a run, and of what its regions take."""
    found = []
    for region in model.all_regions:
        where = "" if region.name == CHART else f", region {region.name}"
        about = f"mode of the run of {model.name}{where}"
        found.append(Variable(mode_variable(RUN_MODE, region.name), "whole", about=about))
        found.append(Variable(f"work.taken_{region.name}", "whole"))
    return found


def start_run_regions(model: Automaton) -> list[Op]:
    """Return what puts the regions beside the chart of a run's model where they start.

    A run enters a mode of the model's chart; the regions beside it go on from tick to tick.
    """
    return [op for op in enter_initial_modes(model, RUN_MODE) if op.target != RUN_MODE]
