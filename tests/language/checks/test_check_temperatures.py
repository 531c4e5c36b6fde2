"""Temperatures in degC: sums and comparisons that use one as a difference are warned of."""

from __future__ import annotations

from pathlib import Path

import pytest

import modewright as mw
from language.loading.load import automaton_of, command_line_value
from language.overlays.expand_document import Project, read_document
from tests.language.spec_builders import problem_lines

SPEC = """language: 1
automaton: limiter
period: 1 s
numbers: float64
parameters:
  T_set: {{value: 20 degC}}
  T_amb: {{unit: degC, value: 5}}
  hyst:  {{value: 3 K}}
  bad:   {{value: 3 degC}}
inputs:
  T:    {{unit: degC, range: [-40, 130]}}
  rise: {{unit: K, range: [0, 100]}}
initial: a
modes:
  a: {{transitions: {{b: {{when: {guard}}}}}}}
  b: {{}}
outputs: [mode]
"""


def warned_names(folder: Path, guard: str) -> list[str]:
    path = folder / "limiter.yaml"
    path.write_text(SPEC.format(guard=guard))
    found = [problem for problem in mw.check(str(path)) if problem.kind == "temperature"]
    assert all(problem.severity == "warning" for problem in found)
    lines = path.read_text().splitlines()
    spans = [problem.span for problem in found]
    return [lines[s.line - 1][s.column - 1 :][: s.width] for s in spans]


@pytest.mark.parametrize(
    ("guard", "names"),
    [
        ("T > T_set + bad", ["bad"]),
        ("T > bad + T", ["bad"]),
        ("T < T_set - bad", ["bad"]),
        ("T - T_set > bad", ["bad"]),
        ('"min(T, T_set) < T_amb - bad"', ["bad"]),
        ("T > T_set + hyst", []),
        ("T < T_set - hyst", []),
        ("T - T_set > hyst", []),
        ("T - T_set < T_amb - T_set", []),
        ("T > T_amb + rise", []),
        ("T > T_set", []),
        ("(T + T_set) / 2 > T_amb", []),
        ("T_set + (T - T_amb) > T", []),
    ],
)
def test_a_temperature_is_no_difference(guard: str, names: list[str], tmp_path: Path) -> None:
    assert warned_names(tmp_path, guard) == names


@pytest.mark.parametrize(
    ("guard", "value", "is_refused"),
    [
        ("T > T_set + hyst", "hyst=2 degC", True),
        ("T < T_set - hyst", "hyst=2 degC", True),
        ("T > T_set + hyst", "hyst=2 K", False),
        ("T > hyst", "hyst=2 degC", False),
        ("T > T_set + hyst", "hyst=-2 degC", True),
        ("T > T_set + hyst", "T_set=25 degC", False),
        ("T > T_set + bad", "bad=2 degC", True),
    ],
)
def test_a_new_value_in_degc_is_no_difference(
    guard: str, value: str, is_refused: bool, tmp_path: Path
) -> None:
    path = tmp_path / "limiter.yaml"
    path.write_text(SPEC.format(guard=guard))
    name, text = value.split("=")
    document = read_document(path)
    values = {name: command_line_value(text, name)}
    lines = problem_lines(lambda: automaton_of(document, Project(tmp_path), values))
    told = f"1:{len(name) + 2} `{name}` is a difference of temperatures: 3 degC are 276.15 K"
    assert [line for line in lines if "nowhere" not in line] == ([told] if is_refused else [])
