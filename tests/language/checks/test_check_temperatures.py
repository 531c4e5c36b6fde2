"""Temperatures in degC: sums and comparisons that use one as a difference are warned of."""

from __future__ import annotations

from pathlib import Path

import pytest

import modewright as mw

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
  T:    {{unit: K, range: [230, 400]}}
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
