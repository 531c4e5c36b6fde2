"""Variant group: executes the variants of a batch that share their Programs in C."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine.batch.batch import NO_EVENT, Batch, BatchResult, EventKind
from engine.batch.build_system_program import assembly_of
from engine.batch.compiled_run import EVENT_DTYPE, BuildLibrary
from engine.batch.interpreted_batch import (
    list_event_kinds,
    row_range,
    run_variant,
    scenario_of_variant,
)
from engine.batch.parameter_binding import ProgramGroup
from engine.batch.run_plan import RunPlan, build_run_plan, noise_samples
from engine.results.trajectory import fault_names
from language.ir.program import unqualified_name
from language.programs.system_program import SimulationAssembly, range_event_variables

STATISTIC_KINDS = ("first", "final", "max", "min", "peak", "mean", "rms")
"""Kinds of statistics in the order of their numbers in C."""
CHUNK_SIZE = 2000
"""Number of variants of one call; their events and values are a few megabytes."""


class CompiledGroup:
    """Variants of a batch that share their Programs, with plan and library."""

    def __init__(
        self,
        batch: Batch,
        group: ProgramGroup,
        build: BuildLibrary,
        like: CompiledGroup | None = None,
    ) -> None:
        """Plan and compile the group; the library of `like` is reused for an equal assembly."""
        self.batch, self.group = batch, group
        adjustment = group.binding
        self.system, self.programs = adjustment.system, adjustment.programs
        scenario = scenario_of_variant(batch, adjustment.scenario, int(group.variants[0]))
        self.assembly = assembly_of(self.system, scenario, self.programs)
        self.plan = build_run_plan(self.system, scenario, self.assembly)
        is_same = like is not None and like.assembly == self.assembly
        self.library: Any = like.library if like and is_same else build(self.assembly)
        names = [column.name for column in self.assembly.columns]
        places = dict(zip(names, self.library.columns, strict=True))
        count = len(self.plan.rows.high)
        spans = [row_range(m, scenario.every, count) for m in batch.statistics]
        self.fixed: dict[str, Any] = {
            "measures": len(batch.statistics),
            "measure_columns": _wholes(places[m.signal] for m in batch.statistics),
            "measure_kinds": _wholes(STATISTIC_KINDS.index(m.kind) for m in batch.statistics),
            "measure_firsts": _wholes(first for first, _ in spans),
            "measure_behinds": _wholes(behind for _, behind in spans),
            "outputs": len(batch.outputs),
            "output_columns": _wholes(places[name] for name in batch.outputs),
            "most_events": batch.max_events,
            **self._tables(),
        }
        self.kinds = _kind_places(self.assembly, list_event_kinds(self.programs))

    def rebind(self, batch: Batch) -> CompiledGroup:
        """Return the group for all variants of another batch."""
        found = copy.copy(self)
        found.batch, found.group = batch, ProgramGroup(np.arange(batch.count), self.group.binding)
        return found

    def run(self, result: BatchResult, threads: int) -> None:
        """Execute all variants in chunks on threads and store the results.

        Each chunk writes its own part of the result. Variants that C leaves out are interpreted.
        """
        variants = self.group.variants
        chunks = [variants[k : k + CHUNK_SIZE] for k in range(0, len(variants), CHUNK_SIZE)]
        if threads > 1 and len(variants) > threads:
            size = min(CHUNK_SIZE, -(-len(variants) // threads))
            chunks = [variants[k : k + size] for k in range(0, len(variants), size)]
        with ThreadPoolExecutor(threads) as pool:
            for left in pool.map(partial(self._chunk, result), chunks):
                for variant in left:
                    run_variant(self.batch, result, variant, self.group.binding)

    def _chunk(self, result: BatchResult, variants: NDArray[np.int64]) -> list[int]:
        """Carry some variants out; return those that are left to the interpreter."""
        batch, count = self.batch, len(variants)
        rows, most = len(self.plan.rows.high), batch.max_events
        measured = np.empty((count, len(batch.statistics)))
        kept = np.empty((count, len(batch.outputs), rows))
        events = np.empty((count, most), dtype=EVENT_DTYPE)
        counts = np.zeros(count, dtype=np.int64)
        is_left = np.zeros(count, dtype=np.uint8)
        faults = np.zeros((count, len(self.programs)), dtype=np.uint32)
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
            "faults": faults,
            "rows": np.empty((self.library.lanes, rows, self.library.width)),
            "inputs_room": np.empty((self.library.lanes, *self.plan.inputs.shape)),
        }
        self.library.bind_plan(plan, members)(0, count)
        for place, measure in enumerate(batch.statistics):
            result.statistics[measure.name][variants] = measured[:, place]
        for place, name in enumerate(batch.outputs):
            result.outputs[name][variants] = kept[:, place]
        result.event_counts[variants] = counts
        self._tell_faults(result, variants, faults)
        filled = np.arange(most) < counts[:, None]
        result.event_times[variants] = np.where(filled, events["time"], np.nan)
        numbers = np.where(filled, events["number"], 0)
        result.event_kinds[variants] = np.where(filled, self.kinds[numbers], NO_EVENT)
        return [int(variant) for variant in variants[is_left != 0]]

    def _tell_faults(
        self, result: BatchResult, variants: NDArray[np.int64], words: NDArray[np.uint32]
    ) -> None:
        """Tell which bits of the fault words (n_variants, n_programs) are set."""
        assert isinstance(result.faults, dict)
        for place in np.flatnonzero(words.any(axis=1)).tolist():
            named = zip(self.programs.items(), words[place].tolist(), strict=True)
            result.faults[int(variants[place])] = tuple(
                fault
                for (name, program), word in named
                for fault in fault_names(name, program, word)
            )

    def _values(self, variants: NDArray[np.int64]) -> NDArray[np.float64]:
        names = list(self.assembly.tunables())
        found = np.empty((len(variants), len(names)))
        arrays = {**self.batch.parameters, **self.batch.initial}
        tuned = {place: arrays[name] for name, place in self.group.binding.tunables.items()}
        for place, (owner, constant) in enumerate(names):
            array = tuned.get((owner, unqualified_name(constant.name)))
            found[:, place] = constant.value if array is None else array[variants]
        return found

    def _noise(self, variants: NDArray[np.int64]) -> tuple[RunPlan, NDArray[np.int64]]:
        strides = np.zeros(len(self.assembly.sensors) + 1, dtype=np.int64)
        if self.batch.seeds is None or not self.plan.noise:
            return self.plan, strides
        noise = {}
        for name, one in self.plan.noise.items():
            seeds = self.batch.seeds[variants].tolist()
            noise[name] = np.stack([noise_samples(seed, name, len(one)) for seed in seeds])
            strides[list(self.assembly.sensors).index(name)] = len(one)
        return RunPlan(**{**vars(self.plan), "noise": noise}), strides

    def _all_tables(self) -> list[Any]:
        """Return the table of each column of inputs that a variant changes."""
        lines = self.system.delayed_signals
        sources = [lines[n].source if n in lines else n for n in self.assembly.inputs]
        return [self.batch.inputs[s] for s in sources if s in self.batch.inputs]

    def _tables(self) -> dict[str, Any]:
        lines, tables = self.system.delayed_signals, self.batch.inputs
        inputs, pieces, widths = [], [], []
        for place, name in enumerate(self.assembly.inputs):
            line = lines.get(name)
            table = tables.get(line.source if line else name)
            if table is not None:
                delay = line.delay if line else 0
                inputs.append(place)
                widths.append(len(table.starts))
                pieces.append(self.plan.pieces_at([start + delay for start in table.starts]))
        return {
            "tables": len(inputs),
            "table_inputs": _wholes(inputs),
            "table_pieces": pieces,
            "table_widths": _wholes(widths),
        }


def _wholes(values: Any) -> NDArray[np.int64]:
    return np.array([*values, 0], dtype=np.int64)


def _kind_places(assembly: SimulationAssembly, kinds: Sequence[EventKind]) -> NDArray[np.int32]:
    """Return the place among the kinds of each event number in C."""
    found = []
    for name, program in assembly.programs.items():
        for info in program.transitions:
            source, target = program.endpoint_names(info)
            found.append(EventKind(name, info.name, source, target, info.region))
        for variable in range_event_variables(program):
            found.append(EventKind(name, f"range {unqualified_name(variable.name)}", kind="range"))
        for invariant in program.invariants:
            text, region = f"invariant {invariant.name}", invariant.region
            found.append(EventKind(name, text, region=region, kind="invariant"))
    return np.array([kinds.index(kind) for kind in found] or [0], dtype=np.int32)
