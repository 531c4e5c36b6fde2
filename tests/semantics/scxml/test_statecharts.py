"""Charts conform: the cases of the W3C's test framework that two implementations agree on."""

from __future__ import annotations

import json
from pathlib import Path
from random import Random

import pytest

from tests.semantics.scxml.case_execution import (
    Active,
    LoadedCase,
    load_case,
    run_compiled,
    run_interpreted,
)
from tests.semantics.scxml.oracle import Oracle
from tests.semantics.scxml.random_chart import random_case

FILE = Path(__file__).resolve().parents[2] / "data" / "conformance" / "statechart_cases.json"
RAW = json.loads(FILE.read_text("utf-8"))
NAMES = [raw["name"] for raw in RAW]

SHOWING = (175, 392)
"""Random charts in which a transition leads to a mode around its own, which the cases lack."""
RANDOM = 24
"""Random charts beside them: the larger part of the time of a case is its check."""


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> list[LoadedCase]:
    folder = tmp_path_factory.mktemp("conformance")
    return [load_case(raw, f"case_{number}", folder) for number, raw in enumerate(RAW)]


@pytest.fixture(scope="module")
def from_c(cases: list[LoadedCase], tmp_path_factory: pytest.TempPathFactory) -> list[list[Active]]:
    return run_compiled(cases, tmp_path_factory.mktemp("conformance_c"))


@pytest.mark.parametrize("number", range(len(RAW)), ids=NAMES)
def test_the_interpreter_has_the_active_modes_of_the_case(
    cases: list[LoadedCase], number: int
) -> None:
    assert run_interpreted(cases[number]) == list(cases[number].expected)


@pytest.mark.parametrize("number", range(len(RAW)), ids=NAMES)
def test_the_c_has_the_active_modes_of_the_case(
    cases: list[LoadedCase], from_c: list[list[Active]], number: int
) -> None:
    assert from_c[number] == list(cases[number].expected)


def test_the_oracle_has_the_active_modes_of_the_cases() -> None:
    """What random charts are compared with is right where others agree."""
    for raw in RAW:
        oracle = Oracle(raw["chart"])
        assert sorted(oracle.atomic) == sorted(raw["initial"])
        for step in raw["steps"]:
            oracle.send(step["event"])
            assert sorted(oracle.atomic) == sorted(step["expect"])


def test_random_charts_do_what_the_algorithm_of_scxml_says(tmp_path: Path) -> None:
    seeds: list[int | str] = [*SHOWING, *(f"chart {k}" for k in range(RANDOM))]
    raw = [random_case(Random(seed)) for seed in seeds]
    charts = [load_case(one, f"chart_{k}", tmp_path) for k, one in enumerate(raw)]
    for one in charts:
        assert run_interpreted(one) == list(one.expected), one.case.text
    assert run_compiled(charts[:8], tmp_path) == [list(one.expected) for one in charts[:8]]
