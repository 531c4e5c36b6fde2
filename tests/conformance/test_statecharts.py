"""Charts conform: the cases of the W3C's test framework that two implementations agree on."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.conformance.running import Active, Made, compiled, interpreted, made

FILE = Path(__file__).resolve().parents[1] / "data" / "conformance" / "statechart_cases.json"
RAW = json.loads(FILE.read_text("utf-8"))
NAMES = [raw["name"] for raw in RAW]


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> list[Made]:
    folder = tmp_path_factory.mktemp("conformance")
    return [made(raw, f"case_{number}", folder) for number, raw in enumerate(RAW)]


@pytest.fixture(scope="module")
def from_c(cases: list[Made], tmp_path_factory: pytest.TempPathFactory) -> list[list[Active]]:
    return compiled(cases, tmp_path_factory.mktemp("conformance_c"))


@pytest.mark.parametrize("number", range(len(RAW)), ids=NAMES)
def test_the_interpreter_has_the_active_modes_of_the_case(cases: list[Made], number: int) -> None:
    assert interpreted(cases[number]) == list(cases[number].wanted)


@pytest.mark.parametrize("number", range(len(RAW)), ids=NAMES)
def test_the_c_has_the_active_modes_of_the_case(
    cases: list[Made], from_c: list[list[Active]], number: int
) -> None:
    assert from_c[number] == list(cases[number].wanted)
