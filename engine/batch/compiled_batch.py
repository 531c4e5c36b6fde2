"""Planned batch: the variants of a batch carried out by a compiled library, on several threads.

Results are those of the interpreter, bit for bit. What a library leaves (a run that stopped, a
range of a sampled instance) the interpreter does.
"""

from __future__ import annotations

import copy
import dataclasses
import os
from collections.abc import Sequence

import numpy as np

from engine.batch.batch import Batch, BatchResult
from engine.batch.compiled_group import CompiledGroup
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

MAX_CACHED = 4
"""Plans of a planner: the scenarios of a study take turns."""


def run_compiled_batch(
    batch: Batch, build: BuildLibrary, threads: int | None = None, min_steps: int = 0
) -> BatchResult:
    """Return what is kept of each variant, by compiled C on several threads.

    Variants that share a Program and have fewer than `min_steps` steps in all are not compiled for.
    """
    return CompiledBatch(batch, build, min_steps).run(threads)


class CompiledBatch:
    """A batch that is planned: it can be carried out again and again.

    Variants with Programs of their own are compiled group by group.
    """

    def __init__(
        self,
        batch: Batch,
        build: BuildLibrary,
        min_steps: int = 0,
        binding: ParameterBinding | None = None,
    ) -> None:
        """Compile what the batch needs; `reason` says why it is left to the interpreter.

        `binding` is how a batch that differs in numbers alone is carried out.
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
        """Return what is planned already for a batch that differs in numbers alone, else None.

        Where inputs step at times of their own the plan of each variant is made, for the same
        Programs; so it is where the interpreter took the few there were, whose steps then count
        as steps of all that is compiled for.
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
        """Return what is kept of each variant."""
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
    """Plans batches; a batch like one of the last ones, but for its numbers, has its plan."""

    def __init__(self, build: BuildLibrary, min_steps: int = 0) -> None:
        """Plan nothing yet; `build` and `min_steps` are those of a planned batch."""
        self.build, self.least = build, min_steps
        self._kept: list[CompiledBatch] = []

    def get_or_compile(self, batch: Batch) -> CompiledBatch:
        """Return a batch that is planned."""
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
