"""Mutants: a mistake in what a chart does is seen by the cases or by random charts."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from random import Random
from typing import Any

import pytest

from language.charts import (
    entry_blocks as entering,
    exit_blocks as leaving,
    transition_selection as selecting,
)
from language.charts.chart_context import ChartContext
from language.ir.ops import Assign, Block, Op, Value
from language.model.statechart import Chart, ChartNode
from tests.semantics.scxml.case_execution import load_case, run_interpreted
from tests.semantics.scxml.random_chart import random_case
from tests.semantics.scxml.test_statecharts import RAW, SHOWING

Patch = Callable[[pytest.MonkeyPatch], None]


def _targets_around(patch: pytest.MonkeyPatch) -> None:
    """A target around its source is not left and entered again."""

    def domain(self: Chart, source: ChartNode, targets: Any, internal: bool) -> int | None:
        wanted = [target.index for target in targets]
        for node in self.ancestors(source):
            if node.kind == "compound" and all(node.contains(w) for w in wanted):
                return node.index
        return 0

    patch.setattr(Chart, "domain", domain)


def _no_history(patch: pytest.MonkeyPatch) -> None:
    """What a mode was left in is not kept."""
    old = leaving._exit_node

    def one(charting: ChartContext, node: ChartNode) -> list[Op]:
        return [op for op in old(charting, node) if not str(op).count("memory.left_")]

    patch.setattr(leaving, "_exit_node", one)


def _shallow_is_deep(patch: pytest.MonkeyPatch) -> None:
    """A shallow history enters all that was active."""
    old = entering._EntrySet.enter_history

    def recalled(self: Any, node: ChartNode, how: str, usual: Block) -> Block:
        return old(self, node, "deep", usual)

    patch.setattr(entering._EntrySet, "enter_history", recalled)


def _outer_first(patch: pytest.MonkeyPatch) -> None:
    """A transition of the outer mode wins."""
    old = selecting.selection_blocks

    def blocks(charting: ChartContext) -> dict[str, Block]:
        chart = dataclasses.replace(charting.chart, order="outer_first")
        return old(dataclasses.replace(charting, chart=chart))

    patch.setattr("language.charts.micro_step.selection_blocks", blocks)


def _all_requests(patch: pytest.MonkeyPatch) -> None:
    """The requests of regions that leave each other are all taken."""
    patch.setattr(selecting, "_conflicting_regions", lambda charting, region: [])


def _first_stays(patch: pytest.MonkeyPatch) -> None:
    """A request from further inside does not drive out one from outside."""
    patch.setattr(Chart, "is_region_inside", lambda self, region, other: False)


def _regions_at_initial(patch: pytest.MonkeyPatch) -> None:
    """Of several targets only the first is entered."""
    old = entering._EntrySet.enter_parallel

    def side_by_side(self: Any, node: ChartNode, wanted: Any) -> Block:
        return old(self, node, list(wanted)[:1])

    patch.setattr(entering._EntrySet, "enter_parallel", side_by_side)


def _still_active(patch: pytest.MonkeyPatch) -> None:
    """Regions of a mode that is left stay active."""
    old = entering.lower_entry_set

    def enter(charting: ChartContext, transition: Any, way: Any) -> Block:
        numbers = {region.inactive for region in charting.automaton.regions}
        ops = old(charting, transition, way)
        return tuple(op for op in ops if not _sets(op, numbers))

    patch.setattr("language.charts.micro_step.lower_entry_set", enter)


def _sets(op: Op, numbers: set[int | None]) -> bool:
    return isinstance(op, Assign) and isinstance(op.value, Value) and op.value.value in numbers


MUTANTS: Mapping[str, Patch] = {
    patch.__name__.removeprefix("_"): patch
    for patch in (
        _targets_around,
        _no_history,
        _shallow_is_deep,
        _outer_first,
        _all_requests,
        _first_stays,
        _regions_at_initial,
        _still_active,
    )
}


def _raw() -> Iterator[Mapping[str, Any]]:
    parts = ("history", "hierarchy", "more-parallel", "parallel")
    yield from (raw for raw in RAW if raw["name"].startswith(parts))
    yield from (random_case(Random(seed)) for seed in SHOWING)


@pytest.mark.parametrize("mutant", MUTANTS)
def test_a_mistake_in_what_a_chart_does_is_seen(
    mutant: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    MUTANTS[mutant](monkeypatch)
    for number, raw in enumerate(_raw()):
        one = load_case(json.loads(json.dumps(raw)), f"{mutant}_{number}", tmp_path)
        if run_interpreted(one) != list(one.expected):
            return
    pytest.fail(f"nothing shows that {MUTANTS[mutant].__doc__}")
