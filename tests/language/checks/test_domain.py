"""Divisors and roots: what may happen is told, what conditions around a place exclude is not."""

from __future__ import annotations

from pathlib import Path

import pytest

import modewright as mw

SPEC = """language: 1
automaton: divides
period: 10 ms
numbers: float64
inputs:
  u: {{unit: 1, range: [0, 10]}}
  v: {{unit: 1, range: [-5, 5]}}
  j: {{type: int, range: [-3, 3]}}
  f: {{type: bool}}
equations: {{z: "{text}"}}
initial: m
modes: {{m: {{}}}}
outputs: [z]
"""


def refused(folder: Path, text: str) -> bool:
    path = folder / "divides.yaml"
    path.write_text(SPEC.format(text=text))
    found = [problem.kind for problem in mw.check(str(path)) if problem.severity == "error"]
    assert set(found) <= {"domain"}
    return bool(found)


@pytest.mark.parametrize(
    "text",
    [
        "if v < -1 or v > 1 then 1 / v else 0",
        "if not (v >= -1 and v <= 1) then v^-1 else 0",
        "1 / (if j == 0 then 1 else j)",
        "if j != 0 then 1 / j else 0",
        "if j == 0 or f then 0 else 1 / j",
        "if u > v then 1 / (u - v) else 0",
        "if v * v > 4 then 1 / v else 0",
        "sqrt(u - min(u, 3))",
        "if f then 1 / (v + 6) else (if abs(v) < 1 then 0 else 1 / v)",
    ],
)
def test_what_conditions_exclude_is_no_mistake(text: str, tmp_path: Path) -> None:
    assert not refused(tmp_path, text)


@pytest.mark.parametrize(
    "text",
    [
        "if v < -1 or v > -2 then 1 / v else 0",
        "if v < -1 and v > -2 then 0 else 1 / v",
        "1 / (if j == 1 then 1 else j)",
        "if j != 0 or f then 1 / j else 0",
        "if u >= v then 1 / (u - v) else 0",
        "if v * v < 4 then 1 / v else 0",
        "sqrt(u - min(v, 3) - 0.1)",
        "if f then 1 / v else (if abs(v) < 1 then 0 else 1 / v)",
    ],
)
def test_what_conditions_allow_is_told(text: str, tmp_path: Path) -> None:
    assert refused(tmp_path, text)
