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

from engine.adjustment import Adjustment, Group, ends_of, groups, require_known
from engine.batch import Batch, BatchResult
from engine.plan import why_not_planned
from engine.planned import Build
from engine.planned_group import PlannedGroup
from engine.variants import empty_result, keep_variant, run_variants, variant_scenario

KEPT = 4
"""Plans of a planner: the scenarios of a study take turns."""


def planned_batch(
    batch: Batch, build: Build, threads: int | None = None, least: int = 0
) -> BatchResult:
    """Return what is kept of each variant, by compiled C on several threads.

    Variants that share a Program and have fewer than `least` steps in all are not compiled for.
    """
    return PlannedBatch(batch, build, least).carry_out(threads)


class PlannedBatch:
    """A batch that is planned: it can be carried out again and again.

    Variants with Programs of their own are compiled group by group.
    """

    def __init__(
        self, batch: Batch, build: Build, least: int = 0, known: Adjustment | None = None
    ) -> None:
        """Compile what the batch needs; `reason` says why it is left to the interpreter.

        `known` is how a batch that differs in numbers alone is carried out.
        """
        self.batch, self.build, self.least = batch, build, least
        self.reason: str | None = None
        self._parts: list[PlannedGroup] = []
        found = [Group(np.arange(batch.count), known)] if known else groups(batch)
        like = None
        self._few = [group for group in found if _steps(group) < least]
        for group in _of_one_plan(batch, [g for g in found if _steps(g) >= least]):
            adjustment = group.adjustment
            scenario = variant_scenario(batch, adjustment.scenario, int(group.variants[0]))
            reason = why_not_planned(adjustment.system, scenario, adjustment.programs)
            self.reason = reason or _why_not_tuned(group)
            if self.reason:
                return
            like = PlannedGroup(batch, group, build, like)
            self._parts.append(like)
        if not found:
            raise ValueError("a batch has at least one variant")

    def again(self, batch: Batch) -> PlannedBatch | None:
        """Return what is planned already for a batch that differs in numbers alone, else None.

        Where inputs step at times of their own the plan of each variant is made, for the same
        Programs; so it is where the interpreter took the few there were, whose steps then count
        as steps of all that is compiled for.
        """
        if self.reason or _form(batch) != _form(self.batch):
            return None
        first = self._parts[0].group if self._parts else self._few[0]
        adjustment = first.adjustment
        if adjustment.rebuilt:
            return None
        ends = adjustment.ends
        for name, (low, high) in ends_of(batch).items():
            if name not in ends or not ends[name][0] <= low <= high <= ends[name][1]:
                return None
        require_known(batch)
        if batch.courses or self._few:
            least = self.least - sum(map(_steps, self._few))
            return PlannedBatch(batch, self.build, least, adjustment)
        found = copy.copy(self)
        found.batch, found._parts = batch, [self._parts[0].of(batch)]
        return found

    def carry_out(self, threads: int | None = None) -> BatchResult:
        """Return what is kept of each variant."""
        if self.reason:
            note = f"interpreter: {self.reason}"
            return BatchResult(**{**vars(run_variants(self.batch)), "note": note})
        first = self._parts[0].group if self._parts else self._few[0]
        note = "compiled" if self._parts else "interpreter: too few steps to compile for"
        result = empty_result(self.batch, first.adjustment, note)
        for part in self._parts:
            part.run(result, threads or os.cpu_count() or 1)
        for group in self._few:
            for variant in group.variants.tolist():
                keep_variant(self.batch, result, variant, group.adjustment)
        return result


class Planner:
    """Plans batches; a batch like one of the last ones, but for its numbers, has its plan."""

    def __init__(self, build: Build, least: int = 0) -> None:
        """Plan nothing yet; `build` and `least` are those of a planned batch."""
        self.build, self.least = build, least
        self._kept: list[PlannedBatch] = []

    def planned(self, batch: Batch) -> PlannedBatch:
        """Return a batch that is planned."""
        for place, known in enumerate(self._kept):
            if found := known.again(batch):
                self._kept[place] = found
                return found
        fresh = PlannedBatch(batch, self.build, self.least)
        self._kept = [fresh, *self._kept[: KEPT - 1]]
        return fresh


def _form(batch: Batch) -> object:
    """Return what a batch is but for its numbers, and for how many they are.

    Of inputs that step at other times in each variant it is what Programs know of them: which
    change in between, and by what formula.
    """
    scenario: object = batch.scenario
    if batch.courses:
        moving = [
            (name, [piece.formula for piece in stimulus.pieces])
            for name, stimulus in batch.scenario.inputs.items()
            if stimulus.varies
        ]
        scenario = dataclasses.replace(batch.scenario, inputs={}), moving
    starts = [(name, table.starts) for name, table in batch.inputs.items()]
    names = list(batch.parameters), list(batch.initial), starts, batch.seeds is None
    wanted = batch.measures, batch.outputs, batch.most_events
    return batch.system, scenario, names, wanted


def _steps(group: Group) -> int:
    """Return how many steps and ticks the variants of a group have in all."""
    horizon = group.adjustment.scenario.horizon
    assert horizon is not None
    programs = group.adjustment.programs.values()
    return len(group.variants) * sum(int(horizon / program.major_step) for program in programs)


def _of_one_plan(batch: Batch, found: Sequence[Group]) -> list[Group]:
    """Return the groups; where inputs step at other times, each variant is one."""
    if not batch.courses:
        return list(found)
    pairs = ((group.adjustment, variant) for group in found for variant in group.variants)
    return [Group(np.array([variant]), adjustment) for adjustment, variant in pairs]


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
