"""Run: a mode of the model inside a tick, following the model's own located transitions (rule 2c).

Blocks: those of the model's field and motion, `switch_<mode>` (one of its transitions), and for a
mode of ours that runs, `run_<mode>`: the period, segment by segment, at most `events` jumps.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from language.check_memory import uses_memory
from language.evaluate import Scalar
from language.field import (
    ALWAYS,
    Field,
    at_state,
    by_mode,
    field_blocks,
    field_variables,
    switch,
)
from language.integration import method_of
from language.limit import kept
from language.linear import Point
from language.linearised import linearised
from language.lower import variable_names
from language.model import CHART, Automaton, Mode, Run as ModelRun
from language.motion import RUN_HALVINGS, merge_time, motion_blocks, motion_variables
from language.number import rounded
from language.operation import (
    Assign,
    Block,
    Branch,
    Compare,
    Expr,
    FaultBit,
    Loop,
    Op,
    Ref,
    Run,
    Value,
    real,
    subtract,
    whole,
)
from language.parallel import Selection, parallel_blocks, parallel_step
from language.parameter import constant_names, typed
from language.problem import Problems
from language.program import Constant, MotionInfo, Variable, mode_variable
from language.region import by_priority
from language.resting import carried_on
from language.syntax import form
from language.wiring import enter_initial

EVENT_LIMIT = "event_limit"
MODE = "memory.run_mode"
HOLD = "hold"
DIVIDING = ("midpoint", "rk4")
"""Methods with a polynomial that divides by the step: of a short one it may be of any size."""
LEAST_REST = Fraction(1, 2**60)
"""Periods. The rest after a crossing that is no end is at least 2^-25 of its step (`RUN_HALVINGS`):
two crossings leave more than this, or nothing.
"""


@dataclass(frozen=True)
class Motion:
    """What the runs of an automaton share."""

    blocks: dict[str, Block]
    variables: tuple[Variable, ...]
    constants: tuple[Constant, ...]
    info: MotionInfo


def run_motion(
    automaton: Automaton, runs: list[ModelRun], values: Mapping[str, Scalar], problems: Problems
) -> Motion:
    """Return the motion of the model inside a tick; `values` are those of the constants."""
    model = automaton.model
    assert model and automaton.period is not None
    held = tuple(kept(automaton, carried_on(model))[1])
    first = runs[0]
    _require_one_way(runs, problems)
    point = Point(automaton, values, {})
    if first.linearise is not None:
        model = linearised(model, first, point, problems)
    inputs = _inputs(automaton, problems)
    _refuse_memory(model, problems)
    _refuse_actions(automaton, model, problems)
    field = Field(
        model,
        constant_names(automaton),
        inputs,
        MODE,
        f"{model.name} ",
        is_staged=automaton.numbers == "float64",
    )
    blocks = field_blocks(field)
    h = automaton.period / first.substeps
    place = first.method_span or first.span
    method, info = method_of(first.method, field, blocks, point, h, place, problems)
    events = max(run.events if run.follow else 0 for run in runs)
    merge = real(merge_time(automaton.numbers, automaton.period))
    made = {
        **blocks,
        **method.blocks,
        **motion_blocks(field, method, blocks, merge, RUN_HALVINGS, lambda mode: None),
    }
    made.update(_switches(field, problems))
    made.update({HOLD: held} if first.method in DIVIDING and held else {})
    variables = (*_own_variables(model), *field_variables(field), *motion_variables(field, method))
    return Motion(made, variables, method.constants, dataclasses.replace(info, events=events))


def _own_variables(model: Automaton) -> tuple[Variable, ...]:
    return (
        *_modes(model),
        Variable("work.left", "real", "s", about="rest of the tick, or of its substep"),
        Variable("work.piece", "whole"),
        Variable("work.substep", "whole"),
    )


def _refuse_memory(model: Automaton, problems: Problems) -> None:
    remembering = uses_memory(model)
    if remembering:
        label = "a run inside a tick follows what has no memory"
        problems.error("run", remembering.span, label)
        problems.stop_if_any()


def _require_one_way(runs: list[ModelRun], problems: Problems) -> None:
    for run in runs:
        if _way(run) != _way(runs[0]):
            label = "all runs of an automaton have one method, one number of substeps and one point"
            problems.error("run", run.span, label)


def run_block(automaton: Automaton, run: ModelRun, rest: Expr | None = None) -> Block:
    """Return the advance of a mode that runs the model: the whole period, through its events.

    Or `rest`, a part of the period [s]: then the run has one substep.
    """
    model = automaton.model
    assert model and automaton.period is not None
    field = Field(model, {}, {}, MODE, "")
    length = real(automaton.period / run.substeps) if rest is None else rest
    before, held = holding(automaton, run.method, carried_on(model))
    inside, outside = (held, ()) if run.follow and run.method in DIVIDING else ((), held)
    if run.follow:
        body = _through_events(automaton, field, run, length, inside)
    else:
        body = _one_flow(automaton, field, run, length)
    moved: Block = body if run.substeps == 1 else (Loop(run.substeps, "work.substep", body),)
    return (*before, *moved, *outside)


def holding(automaton: Automaton, method: str, names: Sequence[str]) -> tuple[Block, Block]:
    """Return what stands before and after operations that move some states of the model: they are
    held in their ranges, by the block of all runs where there is one.
    """
    assert automaton.model
    is_shared = method in DIVIDING
    before, after = kept(automaton, carried_on(automaton.model) if is_shared else names)
    return tuple(before), (Run(HOLD),) if is_shared and after else tuple(after)


def _through_events(
    automaton: Automaton, field: Field, run: ModelRun, length: Expr, held: Block
) -> Block:
    """One substep, segment by segment, at most `events` jumps; states are `held` after each."""
    assert automaton.period is not None
    may_jump = Compare("<", Ref("work.piece"), whole(run.events))
    at_limit: Block = (FaultBit(EVENT_LIMIT), Assign("work.left", real(0.0)))
    look = (*at_state(field), by_mode(field, "guards"))
    after: Block = (Branch(may_jump, (*look, by_mode(field, "switch")), at_limit),)
    segment: Block = (
        Assign("work.h", Ref("work.left")),
        by_mode(field, "move"),
        *held,
        Assign("work.left", subtract(Ref("work.left"), Ref("work.elapsed"))),
        Branch(Ref("work.crossed"), after),
    )
    least = automaton.period * LEAST_REST if run.method in DIVIDING else Fraction(0)
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


def _inputs(automaton: Automaton, problems: Problems) -> dict[str, Expr]:
    """A run reads the inputs of the tick before; what is no input here has its default."""
    model = automaton.model
    assert model
    found: dict[str, Expr] = {}
    for name, thing in model.inputs.items():
        found[name] = real(0.0)
        if name in automaton.inputs:
            found[name] = variable_names(automaton, "before")[name]
        elif thing.default is not None:
            found[name] = Value(typed(rounded(thing.default), thing.type))
        else:
            label = f"the run needs an input `{name}`: `{model.name}` has no default for it"
            problems.error("run", automaton.span, label)
    return found


def _one_flow(automaton: Automaton, field: Field, run: ModelRun, length: Expr) -> Block:
    """One substep in the flow of one mode: no guard of the model is looked at."""
    ends = [Assign(f"state.{name}", Ref(f"work.end_{name}")) for name in field.states]
    step = Run(f"step_{run.mode}")
    return (Assign("work.h", length, f"{automaton.name} {run.key}"), step, *ends)


def _way(run: ModelRun) -> tuple[object, ...]:
    at = {name: form(formula.tree) for name, formula in (run.linearise or {}).items()}
    return run.method, run.substeps, run.linearise is None, at


def _switches(field: Field, problems: Problems) -> dict[str, Block]:
    """Return `switch_<mode>`: one micro-step of the run's model."""
    model = field.automaton
    for mode in model.all_modes:
        for transition in mode.transitions:
            if transition.wait:
                label = "a run inside a tick follows transitions without a wait only"
                problems.error("run", transition.wait.span, label)
    if not model.regions:
        return {f"switch_{mode.name}": _switch(field, mode) for mode in model.modes.values()}
    keys = [transition.key for mode in model.all_modes for transition in mode.transitions]
    selection = Selection(
        verb="switch",
        taken=lambda region: f"work.taken_{region}",
        number=lambda transition: keys.index(transition.key) + 1,
        enabled=lambda transition, slot: Ref(f"work.guard_{slot}"),
        moved=lambda transition: (),
    )
    blocks = parallel_blocks(field, selection)
    for mode in model.modes.values():
        blocks[f"switch_{mode.name}"] = parallel_step(field, mode, selection)
    return blocks


def _switch(field: Field, mode: Mode) -> Block:
    """A crossing is located where a guard is true: if none of the others is, the last one is."""
    enabled: dict[int, Expr] = {k: Ref(f"work.guard_{k}") for k in range(len(mode.transitions))}
    for k, _ in by_priority(mode)[-1:]:
        enabled[k] = ALWAYS
    return switch(field, mode, enabled, {})


def _modes(model: Automaton) -> list[Variable]:
    """Return the variables of the modes of a run, and of what its regions take."""
    found = []
    for region in model.all_regions:
        where = "" if region.name == CHART else f", region {region.name}"
        about = f"mode of the run of {model.name}{where}"
        found.append(Variable(mode_variable(MODE, region.name), "whole", about=about))
        found.append(Variable(f"work.taken_{region.name}", "whole"))
    return found


def start_regions(model: Automaton) -> list[Op]:
    """Return what puts the regions beside the chart of a run's model where they start.

    A run enters a mode of the model's chart; the regions beside it go on from tick to tick.
    """
    return [op for op in enter_initial(model, MODE) if op.target != MODE]
