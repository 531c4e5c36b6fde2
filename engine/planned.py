"""Planned: runs carried out by a compiled library - one, or the variants of a batch.

Results are those of the interpreter, bit for bit. What a library leaves (a run that stopped, a
range of a sampled instance) the interpreter does.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from engine.adjustment import Group, groups
from engine.batch import NO_EVENT, Batch, BatchResult, EventKind
from engine.firing import event, mode_names
from engine.plan import Plan, assembly_of, noise_of, plan_of, why_not_planned
from engine.range_watch import left_range, outside_text
from engine.rows import recorded
from engine.trajectory import Event, Trajectory, column_array
from engine.variants import (
    empty_result,
    first_and_last_row,
    keep_variant,
    run_variants,
    variant_scenario,
)
from language.assembly import Assembly, ranged
from language.experiment import Scenario, System
from language.number import rounded
from language.program import Program, short

EVENT = np.dtype(
    [
        ("time", "f8"),
        ("value", "f8"),
        ("number", "i4"),
        ("micro_step", "i4"),
        ("mode", "i4"),
        ("reserved", "i4"),
    ]
)
"""`Event` of codegen/templates/run.h.jinja."""
KINDS = ("first", "final", "max", "min", "peak", "mean", "rms")
FIRST_EVENTS = 1000
"""Events for which a single run has room at first; it is made again where there were more."""
CHUNK = 2000
"""Variants of one call: their events and values are a few megabytes."""


class Library(Protocol):
    """Compiled runs of an assembly (codegen/library.py)."""

    @property
    def columns(self) -> Sequence[int]:
        """The place of each column of the assembly in a row."""

    @property
    def width(self) -> int:
        """How many numbers a row has."""

    def bound(self, plan: Any, variants: Mapping[str, Any]) -> Callable[[int, int], None]:
        """Return what carries variants out, from a first to one behind the last."""


Build = Callable[[Assembly], Library]


class PlannedRun:
    """One run that is planned: it can be carried out again and again."""

    def __init__(
        self, system: System, scenario: Scenario, programs: Mapping[str, Program], build: Build
    ) -> None:
        """Take a resolved scenario that can be planned."""
        self.scenario = scenario
        self.assembly = assembly_of(system, scenario, programs)
        self.plan = plan_of(system, scenario, self.assembly)
        self.library = build(self.assembly)
        self.recorded = recorded(system, scenario, programs)
        self._values = np.array(
            [rounded(c.value) for _, c in self.assembly.tunables()], dtype=np.float64
        )
        self._rows = np.empty((len(self.plan.rows), self.library.width))
        self._events = np.empty(FIRST_EVENTS, dtype=EVENT)
        self._count = np.zeros(1, dtype=np.int64)
        self._is_left = np.zeros(1, dtype=np.uint8)
        self._call = self.library.bound(self.plan, self._members())

    def carry_out(self) -> bool:
        """Run in C; tell whether that was all. The numbers are in this object's arrays."""
        self._call(0, 1)
        count = int(self._count[0])
        if count > len(self._events):
            self._events = np.empty(2 * count, dtype=EVENT)
            self._call = self.library.bound(self.plan, self._members())
            self._call(0, 1)
        return not self._is_left[0]

    def trajectory(self) -> Trajectory | None:
        """Return the trajectory; None where the interpreter has to tell what happened."""
        if not self.carry_out():
            return None
        programs = self.assembly.programs
        columns = zip(self.recorded, self.library.columns, strict=True)
        return Trajectory(
            name=self.scenario.name,
            times=self.plan.rows.copy(),
            signals={
                column.name: column_array(column.type, self._rows[:, place].tolist())
                if column.type != "real"
                else self._rows[:, place].copy()
                for column, place in columns
            },
            units={column.name: column.unit for column in self.recorded},
            modes={
                signal: names
                for name, program in programs.items()
                for signal, names in mode_names(program, f"{name}.").items()
            },
            events=tuple(_events(self._events[: int(self._count[0])], self.assembly)),
        )

    def _members(self) -> dict[str, Any]:
        return {
            "values": self._values,
            "tables": 0,
            "noise_strides": np.zeros(len(self.assembly.sensors) + 1, dtype=np.int64),
            "measures": 0,
            "outputs": 0,
            "most_events": len(self._events),
            "events": self._events,
            "counts": self._count,
            "is_left": self._is_left,
            "rows": self._rows,
        }


def planned_batch(batch: Batch, build: Build, threads: int | None = None) -> BatchResult:
    """Return what is kept of each variant, by compiled C on several threads.

    Variants with Programs of their own are compiled group by group.
    """
    found: BatchResult | None = None
    for group in groups(batch):
        adjustment = group.adjustment
        scenario = variant_scenario(batch, adjustment.scenario, 0)
        reason = why_not_planned(adjustment.system, scenario, adjustment.programs)
        reason = reason or _why_not_tuned(group)
        if reason:
            result = run_variants(batch)
            note = f"interpreter: {reason}"
            return BatchResult(**{**vars(result), "note": note})
        found = found or empty_result(batch, adjustment, "compiled")
        _Planned(batch, group, build, found).run(threads or os.cpu_count() or 1)
    if found is None:
        raise ValueError("a batch has at least one variant")
    return found


def _why_not_tuned(group: Group) -> str | None:
    known = {
        (owner, c.name): c
        for owner, program in group.adjustment.programs.items()
        for c in program.constants
    }
    for name, (owner, parameter) in group.adjustment.tuned.items():
        constant = known.get((owner, f"calibration.{parameter}"))
        if constant and (constant.type != "real" or constant.items):
            return f"`{name}` is not a real number"
    return None


class _Planned:
    """The variants of a batch that share their Programs."""

    def __init__(self, batch: Batch, group: Group, build: Build, result: BatchResult) -> None:
        self.batch, self.group, self.result = batch, group, result
        adjustment = group.adjustment
        self.system, self.programs = adjustment.system, adjustment.programs
        scenario = variant_scenario(batch, adjustment.scenario, 0)
        self.assembly = assembly_of(self.system, scenario, self.programs)
        self.plan = plan_of(self.system, scenario, self.assembly)
        self.library = build(self.assembly)
        names = [column.name for column in self.assembly.columns]
        places = dict(zip(names, self.library.columns, strict=True))
        count = len(self.plan.rows)
        spans = [first_and_last_row(m, scenario.every, count) for m in batch.measures]
        self.fixed: dict[str, Any] = {
            "measures": len(batch.measures),
            "measure_columns": _wholes(places[m.signal] for m in batch.measures),
            "measure_kinds": _wholes(KINDS.index(m.kind) for m in batch.measures),
            "measure_firsts": _wholes(first for first, _ in spans),
            "measure_behinds": _wholes(behind for _, behind in spans),
            "outputs": len(batch.outputs),
            "output_columns": _wholes(places[name] for name in batch.outputs),
            "most_events": batch.most_events,
            **self._tables(),
        }
        self.kinds = _kind_places(self.assembly, result.kinds)

    def run(self, threads: int) -> None:
        """Carry all out, in chunks on threads; each chunk writes its own part of the result."""
        variants = self.group.variants
        chunks = [variants[k : k + CHUNK] for k in range(0, len(variants), CHUNK)]
        if threads > 1 and len(variants) > threads:
            size = min(CHUNK, -(-len(variants) // threads))
            chunks = [variants[k : k + size] for k in range(0, len(variants), size)]
        with ThreadPoolExecutor(threads) as pool:
            for left in pool.map(self._chunk, chunks):
                for variant in left:
                    keep_variant(self.batch, self.result, variant, self.group.adjustment)

    def _chunk(self, variants: NDArray[np.int64]) -> list[int]:
        """Carry some variants out; return those that are left to the interpreter."""
        batch, result, count = self.batch, self.result, len(variants)
        rows, most = len(self.plan.rows), batch.most_events
        measured = np.empty((count, len(batch.measures)))
        kept = np.empty((count, len(batch.outputs), rows))
        events = np.empty((count, most), dtype=EVENT)
        counts = np.zeros(count, dtype=np.int64)
        is_left = np.zeros(count, dtype=np.uint8)
        plan, strides = self._noise(variants)
        members = {
            **self.fixed,
            "values": self._values(variants),
            "table_values": [
                np.ascontiguousarray(table.values[variants], dtype=np.float64)
                for table in self._all_tables()
            ],
            "noise_strides": strides,
            "measured": measured,
            "kept": kept,
            "events": events,
            "counts": counts,
            "is_left": is_left,
            "rows": np.empty((rows, self.library.width)),
            "inputs_room": np.empty(self.plan.inputs.shape),
        }
        self.library.bound(plan, members)(0, count)
        for place, measure in enumerate(batch.measures):
            result.measures[measure.name][variants] = measured[:, place]
        for place, name in enumerate(batch.outputs):
            result.outputs[name][variants] = kept[:, place]
        result.event_counts[variants] = counts
        filled = np.arange(most) < counts[:, None]
        result.event_times[variants] = np.where(filled, events["time"], np.nan)
        numbers = np.where(filled, events["number"], 0)
        result.event_kinds[variants] = np.where(filled, self.kinds[numbers], NO_EVENT)
        return [int(variant) for variant in variants[is_left != 0]]

    def _values(self, variants: NDArray[np.int64]) -> NDArray[np.float64]:
        names = list(self.assembly.tunables())
        found = np.empty((len(variants), len(names)))
        arrays = {**self.batch.parameters, **self.batch.initial}
        tuned = {place: arrays[name] for name, place in self.group.adjustment.tuned.items()}
        for place, (owner, constant) in enumerate(names):
            array = tuned.get((owner, short(constant.name)))
            found[:, place] = constant.value if array is None else array[variants]
        return found

    def _noise(self, variants: NDArray[np.int64]) -> tuple[Plan, NDArray[np.int64]]:
        strides = np.zeros(len(self.assembly.sensors) + 1, dtype=np.int64)
        if self.batch.seeds is None or not self.plan.noise:
            return self.plan, strides
        noise = {}
        for name, one in self.plan.noise.items():
            seeds = self.batch.seeds[variants].tolist()
            noise[name] = np.stack([noise_of(seed, name, len(one)) for seed in seeds])
            strides[list(self.assembly.sensors).index(name)] = len(one)
        return Plan(**{**vars(self.plan), "noise": noise}), strides

    def _all_tables(self) -> list[Any]:
        """Return the table of each column of inputs that a variant changes."""
        lines = self.system.lines
        sources = [lines[n].source if n in lines else n for n in self.assembly.inputs]
        return [self.batch.inputs[s] for s in sources if s in self.batch.inputs]

    def _tables(self) -> dict[str, Any]:
        lines, tables = self.system.lines, self.batch.inputs
        inputs, pieces, widths = [], [], []
        for place, name in enumerate(self.assembly.inputs):
            line = lines.get(name)
            table = tables.get(line.source if line else name)
            if table is not None:
                delay = line.delay if line else 0
                inputs.append(place)
                widths.append(len(table.starts))
                pieces.append(self.plan.pieces([start + delay for start in table.starts]))
        return {
            "tables": len(inputs),
            "table_inputs": _wholes(inputs),
            "table_pieces": pieces,
            "table_widths": _wholes(widths),
        }


def _wholes(values: Any) -> NDArray[np.int64]:
    return np.array([*values, 0], dtype=np.int64)


def _kind_places(assembly: Assembly, kinds: Sequence[EventKind]) -> NDArray[np.int32]:
    """Return the place among the kinds of each event number in C."""
    found = []
    for name, program in assembly.programs.items():
        for info in program.transitions:
            source = program.mode_name(info.source, info.region)
            target = program.mode_name(info.target, info.region)
            found.append(EventKind(name, info.name, source, target, info.region))
        for variable in ranged(program):
            found.append(EventKind(name, f"range {short(variable.name)}", kind="range"))
    return np.array([kinds.index(kind) for kind in found] or [0], dtype=np.int32)


def _events(found: NDArray[np.void], assembly: Assembly) -> list[Event]:
    """Return what C wrote down as events."""
    known: list[tuple[str, Program, Any]] = []
    for name, program in assembly.programs.items():
        known += [(name, program, info) for info in program.transitions]
        known += [(name, program, variable) for variable in ranged(program)]
    events = []
    for one in found.tolist():
        time, value, number, micro_step, mode, _ = one
        name, program, what = known[number]
        if hasattr(what, "slot"):
            events.append(event(name, program, what, time, micro_step))
        else:
            text = outside_text(what.name, value, *what.range)
            signal = short(what.name)
            events.append(left_range(time, name, signal, program.mode_name(mode), text))
    return events
