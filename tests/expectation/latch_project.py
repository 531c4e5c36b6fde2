"""Latching: a small project whose run is known by hand, and tests written for it.

`level` steps to 2 at 5 ms, to -2 at 20 ms, to 3 at 30 ms; `latch` goes high when it was above 1 for
2 ms: at 7 ms and at 32 ms, low at once when it is below -1: at 20 ms.
"""

from __future__ import annotations

from pathlib import Path

from engine.simulation.simulate import simulate
from expectation.evaluate_expectations import Outcome, evaluate_test
from expectation.expectations import Test
from modewright.api.spec_tests import load_test

AUTOMATON = """\
language: 1
automaton: latch
period: 1 ms
numbers: float64
inputs: {level: {unit: V, range: [-10, 10]}}
discrete: {entered: {type: int, initial: 0, range: [0, 100]}}
equations: {doubled: 2 * level}
initial: low
modes:
  low:  {number: 0, transitions: {high: {when: level > 1 V, wait: 2 ms}}}
  high: {number: 1, entry: {entered: entered + 1}, transitions: {low: {when: level < -1 V}}}
outputs: [doubled, entered, mode]
"""
HEAD = """\
language: 1
test: latched
scenario:
  of: latch
  horizon: 40 ms
  inputs: {level: {start: 0 V, steps: {5 ms: 2 V, 20 ms: -2 V, 30 ms: 3 V}}}
expect:
"""


def write_project(folder: Path, *lines: str, head: str = HEAD) -> Path:
    """Write the automaton and a test with these expectations; return the file of the test."""
    (folder / "spec").mkdir(exist_ok=True)
    (folder / "spec" / "latch.yaml").write_text(AUTOMATON)
    path = folder / "spec" / "test_latched.yaml"
    path.write_text(head + "".join(f"  {line}\n" for line in lines))
    return path


def outcomes(folder: Path, *lines: str) -> list[Outcome]:
    """Return what becomes of expectations on the engine."""
    test = loaded(folder, *lines)
    return list(evaluate_test(test, simulate(test.system, test.scenario)))


def loaded(folder: Path, *lines: str) -> Test:
    """Return a test with these expectations."""
    return load_test(str(write_project(folder, *lines)), folder)
