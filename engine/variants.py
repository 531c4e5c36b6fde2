"""Variants: a batch carried out one variant after another by a stepper like the interpreter."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from fractions import Fraction

import numpy as np

from engine.adjustment import Adjustment, groups
from engine.batch import NO_EVENT, Batch, BatchResult, EventKind, InputTable, Measure, Reals
from engine.interpreter import Interpreter, Stepper
from engine.page import AFTER
from engine.schedule import Grid
from engine.simulate import Build, simulate
from engine.trajectory import Event, Trajectory
from language.experiment import Scenario, System
from language.number import rounded
from language.operation import FaultBit
from language.program import Program, short
from language.signal import Piece, Stimulus
from language.traversal import walk


def run_variants(batch: Batch, build: Build = Interpreter) -> BatchResult:
    """Return what is kept of each variant; `build` makes what runs a Program."""
    found: BatchResult | None = None
    for group in groups(batch):
        kept = found or empty_result(batch, group.adjustment, "interpreter")
        found = kept
        for variant in group.variants.tolist():
            keep_variant(batch, kept, variant, group.adjustment, build)
    if found is None:
        raise ValueError("a batch has at least one variant")
    return found


def empty_result(batch: Batch, adjustment: Adjustment, note: str) -> BatchResult:
    """Return the arrays of a result, to be filled."""
    horizon = adjustment.scenario.horizon
    assert horizon is not None
    grid = Grid(Fraction(0), adjustment.scenario.every)
    times = np.array([float(row) for row, _ in zip(grid, range(grid.count(horizon)), strict=False)])
    shape = (batch.count, batch.most_events)
    return BatchResult(
        measures={m.name: np.full(batch.count, math.nan) for m in batch.measures},
        outputs={name: np.full((batch.count, len(times)), math.nan) for name in batch.outputs},
        times=times,
        kinds=event_kinds(adjustment.programs),
        event_counts=np.zeros(batch.count, dtype=np.int64),
        event_times=np.full(shape, math.nan),
        event_kinds=np.full(shape, NO_EVENT, dtype=np.int32),
        faults={},
        stopped={},
        note=note,
    )


def event_kinds(programs: Mapping[str, Program]) -> tuple[EventKind, ...]:
    """Return what can happen in some instances: transitions, ranges left, invariants."""
    found: list[EventKind] = []
    for name, program in programs.items():
        for info in program.transitions:
            source, target = program.ends(info)
            found.append(EventKind(name, info.name, source, target, info.region))
        for signal in _ranged(program):
            found.append(EventKind(name, f"range {signal}", kind="range"))
        for invariant in program.invariants:
            text = f"invariant {invariant.name}"
            found.append(EventKind(name, text, region=invariant.region, kind="invariant"))
    return tuple(dict.fromkeys(found))


def _ranged(program: Program) -> list[str]:
    """Return the signals whose range may be left."""
    states = [short(v.name) for v in program.variables if v.range is not None]
    ops = (op for block in program.blocks.values() for op in walk(block))
    return [*states, *(op.signal for op in ops if isinstance(op, FaultBit) and op.signal)]


def first_and_last_row(measure: Measure, every: Fraction, count: int) -> tuple[int, int]:
    """Return the first row of a measure and the one behind its last."""
    until = count - 1 if measure.until is None else measure.until // every
    return -int(-measure.since // every), min(count, int(until) + 1)


def measured(measure: Measure, values: Reals) -> float:
    """Return a measure of the rows in its span, from the first to the last in this order."""
    if not len(values) or np.any(np.isnan(values)):
        return math.nan
    match measure.kind:
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


def variant_scenario(batch: Batch, scenario: Scenario, variant: int) -> Scenario:
    """Return the scenario of a variant: its inputs and its seed."""
    inputs = dict(scenario.inputs)
    if batch.courses:
        inputs.update(batch.courses[variant])
    for name, table in batch.inputs.items():
        inputs[name] = _stimulus(batch.system, name, table, variant)
    seed = scenario.seed if batch.seeds is None else int(batch.seeds[variant])
    return dataclasses.replace(scenario, inputs=inputs, seed=seed)


def tuned_values(
    batch: Batch, adjustment: Adjustment, variant: int
) -> dict[tuple[str, str], float]:
    """Return the values of a variant by instance and tunable parameter."""
    arrays = {**batch.parameters, **batch.initial}
    return {place: float(arrays[name][variant]) for name, place in adjustment.tuned.items()}


def _run(batch: Batch, adjustment: Adjustment, variant: int, build: Build) -> Trajectory:
    values = tuned_values(batch, adjustment, variant)
    owners = {id(program): name for name, program in adjustment.programs.items()}

    def tuned(program: Program) -> Stepper:
        stepper = build(program)
        known = {constant.name for constant in program.constants}
        for (owner, parameter), value in values.items():
            name = f"calibration.{parameter}"
            if owner == owners[id(program)] and name in known:
                kind = next(c.type for c in program.constants if c.name == name)
                typed = rounded(value, program.number) if kind == "real" else int(value)
                stepper.set(name, bool(typed) if kind == "truth" else typed)
        for block in AFTER:
            if block in program.blocks:
                stepper.run(block)
        return stepper

    scenario = variant_scenario(batch, adjustment.scenario, variant)
    return simulate(adjustment.system, scenario, tuned, programs=adjustment.programs)


def _stimulus(system: System, name: str, table: InputTable, variant: int) -> Stimulus:
    values = table.values[variant].tolist()
    pieces = tuple(Piece(s, Fraction(v)) for s, v in zip(table.starts, values, strict=True))
    return Stimulus(pieces, truth=system.inputs[name].truth)


def keep_variant(
    batch: Batch,
    result: BatchResult,
    variant: int,
    adjustment: Adjustment,
    build: Build = Interpreter,
) -> None:
    """Run a variant, and put what is kept of it into the result."""
    run = _run(batch, adjustment, variant, build)
    for name, kept in result.outputs.items():
        kept[variant, : len(run.times)] = run.signals[name]
    for measure in batch.measures:
        first, behind = first_and_last_row(measure, batch.scenario.every, len(result.times))
        values = np.asarray(run.signals[measure.signal], dtype=np.float64)[first:behind]
        result.measures[measure.name][variant] = measured(measure, values)
    result.event_counts[variant] = len(run.events)
    for place, event in enumerate(run.events[: batch.most_events]):
        result.event_times[variant, place] = event.time
        result.event_kinds[variant, place] = _place(result.kinds, event)
    if run.faults:
        assert isinstance(result.faults, dict)
        result.faults[variant] = run.faults
    if run.stopped is not None:
        assert isinstance(result.stopped, dict)
        result.stopped[variant] = run.stopped


def _place(kinds: Iterable[EventKind], event: Event) -> int:
    """Return the place of an event among the kinds; ranges and invariants have no modes there."""
    is_move = event.kind == "transition"
    modes = (event.source, event.target) if is_move else ("", "")
    wanted = EventKind(event.instance, event.transition, *modes, event.region, event.kind)
    return list(kinds).index(wanted)
