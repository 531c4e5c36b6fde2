"""Refused: each case here has mistakes; the text beside it is exactly what the user is told."""

from __future__ import annotations

import difflib
from pathlib import Path

import pytest

import modewright as mw
from tests.semantics.invalid_specs.cases import (
    ENDINGS,
    HERE,
    ROOT,
    Case,
    apply_repairs,
    cases,
    error_labels,
    find_repairs,
    problems_of,
    unrelated_warnings,
)
from tests.semantics.invalid_specs.generated_cases import GENERATED_CASES
from tests.semantics.invalid_specs.problem_kinds import kinds

CASES = [pytest.param(case, id=case.name) for case in cases()]
MOST_CHANGED_LINES = 8
"""A neighbour is near: a case of more mistakes than that is two cases."""


@pytest.fixture(autouse=True)
def _in_the_project(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


@pytest.mark.parametrize("case", CASES)
def test_the_user_is_told_exactly_this(case: Case, update: bool) -> None:
    text = mw.render_all(problems_of(case.path)) + "\n"
    if update:
        case.expected.write_text(text, "utf-8")
    assert text == case.expected.read_text("utf-8")
    assert ": error: " in text or ": warning: " in text


@pytest.mark.parametrize("case", CASES)
def test_the_nearest_neighbour_passes(case: Case) -> None:
    assert case.repaired.is_file(), f"write {case.repaired.name}: {case.path.name}, just repaired"
    told = [
        problem
        for problem in problems_of(case.repaired)
        if problem.kind not in unrelated_warnings(case)
    ]
    assert not told, mw.render_all(told)


@pytest.mark.parametrize("case", CASES)
def test_the_neighbour_is_near(case: Case) -> None:
    old, new = (path.read_bytes().split(b"\n") for path in (case.path, case.repaired))
    opcodes = difflib.SequenceMatcher(None, old, new, autojunk=False).get_opcodes()
    changed = sum(max(b - a, d - c) for tag, a, b, c, d in opcodes if tag != "equal")
    assert 0 < changed <= MOST_CHANGED_LINES


@pytest.mark.parametrize("case", CASES)
def test_a_repair_that_the_help_gives_is_one(case: Case, tmp_path: Path) -> None:
    """Every "did you mean `x`?" and "write `x`:" is made; nothing else may come of it."""
    problems = problems_of(case.path)
    shown = str(case.path.relative_to(ROOT))
    found = [(p, text) for p, text in find_repairs(problems) if p.span.source.name == shown]
    if case.path.suffix != ".yaml" or not found:
        return
    (tmp_path / "data").symlink_to(ROOT / "tests" / "data")
    (tmp_path / "semantics" / "invalid_specs").mkdir(parents=True)
    made = tmp_path / "semantics" / "invalid_specs" / case.path.name
    made.write_text(apply_repairs(case.path.read_text("utf-8"), found), "utf-8")
    others = {(p.kind, p.label) for p in problems} - {(p.kind, p.label) for p, _ in found}
    assert {(p.kind, p.label) for p in problems_of(made)} <= others, error_labels(problems_of(made))


@pytest.mark.parametrize("name", GENERATED_CASES)
def test_what_is_no_committed_file_is_refused_and_its_neighbour_passes(
    name: str, tmp_path: Path
) -> None:
    refused, neighbour = GENERATED_CASES[name](tmp_path)
    assert error_labels(problems_of(refused))
    assert problems_of(neighbour) == (), mw.render_all(problems_of(neighbour))


def test_every_kind_of_problem_has_a_case(tmp_path: Path) -> None:
    """Add `<case>.yaml` and its neighbour here for a new kind; see README.md."""
    seen = {problem.kind for case in cases() for problem in problems_of(case.path)}
    for name, make in GENERATED_CASES.items():
        folder = tmp_path / name
        folder.mkdir()
        seen |= {problem.kind for problem in problems_of(make(folder)[0])}
    assert {kind: place for kind, place in kinds().items() if kind not in seen} == {}


def test_no_file_is_left_over() -> None:
    names = {case.name for case in cases()}
    assert {path.stem for path in HERE.glob("*.txt")} == names
    repaired = {path for ending in ENDINGS for path in HERE.glob(f"*.repaired{ending}")}
    assert repaired == {case.repaired for case in cases()}
