"""Interpreted batch: executes the variants of a batch one after the other by a stepper."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from fractions import Fraction

import numpy as np

from engine.batch.batch import (
    NO_EVENT,
    Batch,
    BatchResult,
    EventKind,
    InputTable,
    SignalStatistic,
)
from engine.batch.parameter_binding import ParameterBinding, group_variants
from engine.interpreter.apply_calibration import DERIVE_BLOCKS
from engine.interpreter.interpreter import Interpreter, Stepper
from engine.results.array_types import Reals
from engine.results.sampled_run import Event
from engine.results.trajectory import Trajectory
from engine.simulation.event_schedule import TimeGrid
from engine.simulation.simulate import BuildStepper, simulate
from language.ir.number_type import round_to_type
from language.ir.ops import FaultBit
from language.ir.program import Program, unqualified_name
from language.ir.traversal import walk_ops
from language.model.system import Scenario, Stimulus, StimulusPiece, System


def run_interpreted_batch(batch: Batch, build: BuildStepper = Interpreter) -> BatchResult:
    """Return the results of all variants; `build` creates the stepper of a Program.

    The variants run in the order of the groups of `group_variants`; results are in the order of the
    batch, with the note `interpreter`. Raises ValueError for a batch without variants or with
    unknown names, and SpecError for a value that the checks refuse.
    """
    result: BatchResult | None = None
    for group in group_variants(batch):
        current = result or allocate_result(batch, group.binding, "interpreter")
        result = current
        for variant in group.variants.tolist():
            run_variant(batch, current, variant, group.binding, build)
    if result is None:
        raise ValueError("a batch has at least one variant")
    return result


def allocate_result(batch: Batch, binding: ParameterBinding, note: str) -> BatchResult:
    """Return a result to be filled by variant, whose `note` names the executor.

    Statistics, outputs and event times are NaN, counts 0, event kinds `NO_EVENT`, faults and stops
    empty. `times` are the rows of `record` from 0 s to the horizon, which has to be set.
    """
    horizon = binding.scenario.horizon
    assert horizon is not None
    grid = TimeGrid(Fraction(0), binding.scenario.every)
    times = np.array([float(row) for row, _ in zip(grid, range(grid.count(horizon)), strict=False)])
    shape = (batch.count, batch.max_events)
    return BatchResult(
        statistics={m.name: np.full(batch.count, math.nan) for m in batch.statistics},
        outputs={name: np.full((batch.count, len(times)), math.nan) for name in batch.outputs},
        times=times,
        kinds=list_event_kinds(binding.programs),
        event_counts=np.zeros(batch.count, dtype=np.int64),
        event_times=np.full(shape, math.nan),
        event_kinds=np.full(shape, NO_EVENT, dtype=np.int32),
        faults={},
        stopped={},
        note=note,
    )


def list_event_kinds(programs: Mapping[str, Program]) -> tuple[EventKind, ...]:
    """Return the event kinds of some instances, in their order, each once.

    For each instance these are its transitions (with the names of source and target), then `range
    <signal>` for variables with a range and signals of fault bits, then `invariant <name>`.
    """
    kinds: list[EventKind] = []
    for name, program in programs.items():
        for info in program.transitions:
            source, target = program.endpoint_names(info)
            kinds.append(EventKind(name, info.name, source, target, info.region))
        for signal in _ranged_signals(program):
            kinds.append(EventKind(name, f"range {signal}", kind="range"))
        for invariant in program.invariants:
            text = f"invariant {invariant.name}"
            kinds.append(EventKind(name, text, region=invariant.region, kind="invariant"))
    return tuple(dict.fromkeys(kinds))


def _ranged_signals(program: Program) -> list[str]:
    """Return the variables with a range and the signals of fault bits."""
    states = [unqualified_name(v.name) for v in program.variables if v.range is not None]
    ops = (op for block in program.blocks.values() for op in walk_ops(block))
    return [*states, *(op.signal for op in ops if isinstance(op, FaultBit) and op.signal)]


def row_range(statistic: SignalStatistic, every: Fraction, count: int) -> tuple[int, int]:
    """Return the index of the first row of a statistic and the index after its last row.

    Rows are `every` [s] apart from 0 s, `count` in number. The first row is not before `since`, the
    last not after `until`; without `until` it is the last of all. The first index may be larger
    than the second, if no row lies in the span.
    """
    until = count - 1 if statistic.until is None else statistic.until // every
    return -int(-statistic.since // every), min(count, int(until) + 1)


def evaluate_statistic(statistic: SignalStatistic, values: Reals) -> float:
    """Return a statistic of `values`; NaN if they are empty or one of them is NaN.

    `peak` is the largest magnitude, `rms` the root of the mean square. Sums are accumulated from
    the first to the last value, as in C.
    """
    if not len(values) or np.any(np.isnan(values)):
        return math.nan
    match statistic.kind:
        case "first":
            return float(values[0])
        case "final":
            return float(values[-1])
        case "max":
            return float(np.max(values))
        case "min":
            return float(np.min(values))
        case "peak":
            return float(np.max(np.abs(values)))
        case "mean":
            return float(np.cumsum(values)[-1] / len(values))
        case "rms":
            return float(np.sqrt(np.cumsum(values * values)[-1] / len(values)))


def scenario_of_variant(batch: Batch, scenario: Scenario, variant: int) -> Scenario:
    """Return `scenario` with the inputs and the seed of a variant of the batch.

    Stimuli of `variant_inputs` replace those of the scenario, and steps of `inputs` replace both.
    Without `seeds` the seed of the scenario remains.
    """
    inputs = dict(scenario.inputs)
    if batch.variant_inputs:
        inputs.update(batch.variant_inputs[variant])
    for name, table in batch.inputs.items():
        inputs[name] = _stimulus_of_table(batch.system, name, table, variant)
    seed = scenario.seed if batch.seeds is None else int(batch.seeds[variant])
    return dataclasses.replace(scenario, inputs=inputs, seed=seed)


def tunable_values(
    batch: Batch, binding: ParameterBinding, variant: int
) -> dict[tuple[str, str], float]:
    """Return the values [SI] of a variant by instance and tunable parameter.

    Swept names that need Programs of their own are left out. A swept initial value has the
    parameter `start_of_<state>`.
    """
    arrays = {**batch.parameters, **batch.initial}
    return {place: float(arrays[name][variant]) for name, place in binding.tunables.items()}


def _simulate_variant(
    batch: Batch, binding: ParameterBinding, variant: int, build: BuildStepper
) -> Trajectory:
    """Return the trajectory of a variant with its tunable parameters set."""
    values = tunable_values(batch, binding, variant)

    def build_tuned(program: Program) -> Stepper:
        stepper = build(program)
        known = {constant.name for constant in program.constants}
        for (owner, parameter), value in values.items():
            name = f"calibration.{parameter}"
            if binding.programs[owner] is program and name in known:
                kind = next(c.type for c in program.constants if c.name == name)
                typed = round_to_type(value, program.number_type) if kind == "real" else int(value)
                stepper.set(name, bool(typed) if kind == "truth" else typed)
        for block in DERIVE_BLOCKS:
            if block in program.blocks:
                stepper.run(block)
        return stepper

    scenario = scenario_of_variant(batch, binding.scenario, variant)
    return simulate(binding.system, scenario, build_tuned, programs=binding.programs)


def _stimulus_of_table(system: System, name: str, table: InputTable, variant: int) -> Stimulus:
    """Return the steps of an input table as the stimulus of a variant."""
    values = table.values[variant].tolist()
    pieces = tuple(StimulusPiece(s, Fraction(v)) for s, v in zip(table.starts, values, strict=True))
    return Stimulus(pieces, is_bool=system.inputs[name].is_bool)


def run_variant(
    batch: Batch,
    result: BatchResult,
    variant: int,
    binding: ParameterBinding,
    build: BuildStepper = Interpreter,
) -> None:
    """Run a variant and store its results at its index in `result`.

    Outputs keep their initial value after the end of a run that stopped. Of the events the first
    `max_events` are stored, and all are counted. `faults` and `stopped` get an entry only if there
    are faults or the run stopped. Raises ValueError for an event whose kind `result` lacks.
    """
    run = _simulate_variant(batch, binding, variant, build)
    for name, array in result.outputs.items():
        array[variant, : len(run.times)] = run.signals[name]
    for statistic in batch.statistics:
        first, behind = row_range(statistic, batch.scenario.every, len(result.times))
        values = np.asarray(run.signals[statistic.signal], dtype=np.float64)[first:behind]
        result.statistics[statistic.name][variant] = evaluate_statistic(statistic, values)
    result.event_counts[variant] = len(run.events)
    for place, event in enumerate(run.events[: batch.max_events]):
        result.event_times[variant, place] = event.time
        result.event_kinds[variant, place] = _event_kind_index(result.kinds, event)
    if run.faults:
        assert isinstance(result.faults, dict)
        result.faults[variant] = run.faults
    if run.stopped is not None:
        assert isinstance(result.stopped, dict)
        result.stopped[variant] = run.stopped


def _event_kind_index(kinds: Iterable[EventKind], event: Event) -> int:
    """Return the index of the kind of an event. Raises ValueError for an unknown kind."""
    is_move = event.kind == "transition"
    modes = (event.source, event.target) if is_move else ("", "")
    kind = EventKind(event.instance, event.transition, *modes, event.region, event.kind)
    return list(kinds).index(kind)
