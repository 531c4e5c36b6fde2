"""Compiled batch: executes the variants of a batch in a compiled library, on several threads.

Results are those of the interpreter bit for bit. Variants that the library leaves out (a run that
stopped, a saturated signal) are executed by the interpreter.
"""

from __future__ import annotations

import copy
import dataclasses
import os
from collections.abc import Sequence

import numpy as np

from engine.batch.batch import Batch, BatchResult
from engine.batch.compiled_run import BuildLibrary
from engine.batch.interpreted_batch import (
    allocate_result,
    run_interpreted_batch,
    run_variant,
    scenario_of_variant,
)
from engine.batch.parameter_binding import (
    ParameterBinding,
    ProgramGroup,
    group_variants,
    require_known_names,
    value_bounds,
)
from engine.batch.run_plan import planning_obstacle
from engine.batch.variant_group import CompiledGroup

MAX_CACHED = 4
"""Number of compiled batches in a cache; a study alternates between its scenarios."""


class CompiledBatch:
    """Compiled batch that can run repeatedly.

    Each group of variants that shares its Programs has its own library.
    """

    def __init__(
        self,
        batch: Batch,
        build: BuildLibrary,
        min_steps: int = 0,
        binding: ParameterBinding | None = None,
    ) -> None:
        """Compile the groups of a batch; `reason` is set if the interpreter has to execute it.

        `binding` is a known binding of a batch that differs in numbers only. Raises ValueError for
        a batch without variants.
        """
        self.batch, self.build, self.least = batch, build, min_steps
        self.reason: str | None = None
        self._parts: list[CompiledGroup] = []
        found = (
            [ProgramGroup(np.arange(batch.count), binding)] if binding else group_variants(batch)
        )
        like = None
        self._few = [group for group in found if _steps(group) < min_steps]
        for group in _of_one_plan(batch, [g for g in found if _steps(g) >= min_steps]):
            adjustment = group.binding
            scenario = scenario_of_variant(batch, adjustment.scenario, int(group.variants[0]))
            reason = planning_obstacle(adjustment.system, scenario, adjustment.programs)
            self.reason = reason or _why_not_tuned(group)
            if self.reason:
                return
            like = CompiledGroup(batch, group, build, like)
            self._parts.append(like)
        if not found:
            raise ValueError("a batch has at least one variant")

    def rebind(self, batch: Batch) -> CompiledBatch | None:
        """Return this compiled batch for a batch that differs in numbers only.

        None if it cannot be used. If each variant has its own input times, plans are rebuilt for
        the same Programs. The same holds if the interpreter executes some groups; their steps then
        count for all variants in the decision to compile.
        """
        if self.reason or _form(batch) != _form(self.batch):
            return None
        first = self._parts[0].group if self._parts else self._few[0]
        adjustment = first.binding
        if adjustment.rebuild_reasons:
            return None
        ends = adjustment.bounds
        for name, (low, high) in value_bounds(batch).items():
            if name not in ends or not ends[name][0] <= low <= high <= ends[name][1]:
                return None
        require_known_names(batch)
        if batch.variant_inputs or self._few:
            least = self.least - sum(map(_steps, self._few))
            return CompiledBatch(batch, self.build, least, adjustment)
        found = copy.copy(self)
        found.batch, found._parts = batch, [self._parts[0].rebind(batch)]
        return found

    def run(self, threads: int | None = None) -> BatchResult:
        """Return the results of all variants; `threads` defaults to the number of processors."""
        if self.reason:
            note = f"interpreter: {self.reason}"
            return BatchResult(**{**vars(run_interpreted_batch(self.batch)), "note": note})
        first = self._parts[0].group if self._parts else self._few[0]
        note = "compiled" if self._parts else "interpreter: too few steps to compile for"
        result = allocate_result(self.batch, first.binding, note)
        for part in self._parts:
            part.run(result, threads or os.cpu_count() or 1)
        for group in self._few:
            for variant in group.variants.tolist():
                run_variant(self.batch, result, variant, group.binding)
        return result


class CompiledBatchCache:
    """Cache of compiled batches; a batch that differs from a cached one in numbers reuses it."""

    def __init__(self, build: BuildLibrary, min_steps: int = 0) -> None:
        """Create an empty cache; the arguments are those of a compiled batch."""
        self.build, self.least = build, min_steps
        self._kept: list[CompiledBatch] = []

    def get_or_compile(self, batch: Batch) -> CompiledBatch:
        """Return the compiled form of a batch, from the cache if possible.

        A new one replaces the oldest of `MAX_CACHED` entries.
        """
        for place, known in enumerate(self._kept):
            if found := known.rebind(batch):
                self._kept[place] = found
                return found
        fresh = CompiledBatch(batch, self.build, self.least)
        self._kept = [fresh, *self._kept[: MAX_CACHED - 1]]
        return fresh


def _form(batch: Batch) -> object:
    """Return what a batch is but for its numbers, and for how many they are.

    Of inputs that step at other times in each variant it is what Programs know of them: which
    change in between, and by what formula.
    """
    scenario: object = batch.scenario
    if batch.variant_inputs:
        moving = [
            (name, [piece.formula for piece in stimulus.pieces])
            for name, stimulus in batch.scenario.inputs.items()
            if stimulus.varies
        ]
        scenario = dataclasses.replace(batch.scenario, inputs={}), moving
    starts = [(name, table.starts) for name, table in batch.inputs.items()]
    names = list(batch.parameters), list(batch.initial), starts, batch.seeds is None
    wanted = batch.statistics, batch.outputs, batch.max_events
    return batch.system, scenario, names, wanted


def _steps(group: ProgramGroup) -> int:
    """Return how many steps and ticks the variants of a group have in all."""
    horizon = group.binding.scenario.horizon
    assert horizon is not None
    programs = group.binding.programs.values()
    return len(group.variants) * sum(int(horizon / program.major_step) for program in programs)


def _of_one_plan(batch: Batch, found: Sequence[ProgramGroup]) -> list[ProgramGroup]:
    """Return the groups; where inputs step at other times, each variant is one."""
    if not batch.variant_inputs:
        return list(found)
    pairs = ((group.binding, variant) for group in found for variant in group.variants)
    return [ProgramGroup(np.array([variant]), adjustment) for adjustment, variant in pairs]


def _why_not_tuned(group: ProgramGroup) -> str | None:
    known = {
        (owner, c.name): c
        for owner, program in group.binding.programs.items()
        for c in program.constants
    }
    for name, (owner, parameter) in group.binding.tunables.items():
        constant = known.get((owner, f"calibration.{parameter}"))
        if constant and (constant.type != "real" or constant.items):
            return f"`{name}` is not a real number"
    return None
