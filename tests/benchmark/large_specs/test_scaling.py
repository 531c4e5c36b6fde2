"""Scaling: four times the spec costs about four times the work, counted in calls, not seconds."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType

import pytest

import modewright as mw
from language.checks.check_automaton import MAX_EQUATIONS, MAX_TRANSITIONS
from language.text.diagnostic import Problem, Problems, Source, Span, SpecError
from tests.benchmark.large_specs import spec_generators as shapes

MOST_GROWTH = 6.0
"""Calls for four times the size over those for one: 4 and some that grow as n log n."""
PLACE = Span(Source("large.yaml"), 1, 1)
SHAPES: dict[str, Callable[[int], str]] = {
    "modes": lambda n: shapes.modes_of_equations(n, 3),
    "equations of modes": lambda n: shapes.modes_of_equations(2, 2 * n, sampled=True),
    "a chain from its end": lambda n: shapes.reversed_equations(3 * n),
    "parameters": lambda n: shapes.parameters(6 * n),
    "terms": lambda n: shapes.long_expressions(n // 2),
    "transitions": lambda n: shapes.transitions(n, 3),
    "transitions of ticks": lambda n: shapes.transitions(n, 3, sampled=True),
    "rows of a table": lambda n: shapes.table(4 * n, 4),
    "values of earlier ticks": lambda n: shapes.equations_with_memory(2 * n),
}


def checked(folder: Path, text: str) -> list[Problem]:
    path = folder / "large.yaml"
    path.write_text(text)
    return [problem for problem in mw.check(str(path), folder) if problem.severity == "error"]


def calls(folder: Path, text: str) -> int:
    """Return how many functions of Python a check calls."""
    count = 0

    def counted(frame: FrameType, event: str, arg: object) -> None:
        nonlocal count
        count += event == "call"

    before = sys.getprofile()
    sys.setprofile(counted)
    try:
        assert checked(folder, text) == []
    finally:
        sys.setprofile(before)
    return count


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_four_times_the_size_is_about_four_times_the_work(
    shape: Callable[[int], str], tmp_path: Path
) -> None:
    assert checked(tmp_path, shape(4)) == []  # what is found once for all specs
    small = calls(tmp_path, shape(6))
    assert calls(tmp_path, shape(24)) < MOST_GROWTH * small


def test_instances_with_equal_values_are_checked_once(tmp_path: Path) -> None:
    (tmp_path / "spec").mkdir()
    counts = []
    for instances in (2, 8, 32):
        files = shapes.system(instances, different=1)
        (tmp_path / "spec" / "part.yaml").write_text(files["part"])
        counts.append(calls(tmp_path, files["large"]))
    assert counts[2] < 2.5 * counts[1]


def test_a_mistake_in_each_of_many_instances_is_told_once_for_each(tmp_path: Path) -> None:
    found = checked(tmp_path, shapes.system(40)["large"])
    assert len(found) == 40  # `part` is not there


def test_what_stands_at_the_root_counts_in_each_mode(tmp_path: Path) -> None:
    modes = MAX_EQUATIONS // 500 + 1
    equations = "".join(f"  e_{n}: T_in\n" for n in range(498))
    ways = "".join(f"  m_{n}: {{}}\n" for n in range(modes))
    text = f"{shapes.HEAD}equations:\n{equations}{shapes.FLOW}initial: m_0\nmodes:\n{ways}"
    (problem,) = checked(tmp_path, text + "outputs: [w]\n")
    assert problem.kind == "huge"
    assert f"{500 * modes} equations and balances" in problem.label


def test_a_mode_has_so_many_transitions_and_no_more(tmp_path: Path) -> None:
    assert checked(tmp_path, _ways(MAX_TRANSITIONS)) == []
    (problem,) = checked(tmp_path, _ways(MAX_TRANSITIONS + 1))
    assert problem.label == f"mode `m_0` has {MAX_TRANSITIONS + 1} transitions"


def _ways(count: int) -> str:
    lines = [
        f"      t_{n}: {{to: m_1, when: a > {n}.5 rad and w > 0 rad/s, priority: {n}}}\n"
        for n in range(count)
    ]
    head = f"{shapes.HEAD}{shapes.FLOW}initial: m_0\nmodes:\n  m_0:\n    transitions:\n"
    return head + "".join(lines) + "  m_1: {}\noutputs: [w]\n"


def test_conditions_inside_conditions_cost_no_more_than_their_length(tmp_path: Path) -> None:
    inside = "(if " * 30 + "a" + " > 0 rad then 1 rad else a)" * 30
    text = shapes.HEAD + f'equations: {{e: "{inside}"}}\n' + shapes.FLOW + "outputs: [w, e]\n"
    assert calls(tmp_path, text) < 100_000


def test_problems_that_a_stage_repeats_are_taken_once() -> None:
    problems = Problems()
    problems.error("name", PLACE, "first")
    for _ in range(30):
        with problems.collect_errors():
            problems.raise_if_errors()
    with problems.collect_errors():
        raise SpecError([Problem("name", PLACE, "second")])
    assert [problem.label for problem in problems.reported] == ["first", "second"]
