"""Check: parts of a mode that belong to the other kind of automaton, or exclude each other."""

from __future__ import annotations

from pathlib import Path

import pytest

from language.loading.load import load_automaton
from tests.language.spec_builders import automaton, problem_lines, project_of

CONTINUOUS = """language: 1
automaton: model
states: {x: {unit: m, initial: 0 m, range: [-1, 1]}}
flow: {x: der(x) = -1 1/s * x}
modes: {only: {MORE}}
"""
SAMPLED = """language: 1
automaton: sampled
period: 1 ms
numbers: float64
model: model
inputs: {x_m: {unit: m}}
states: {x: {initial: 0 m, range: [-1, 1]}, z: {unit: m, initial: 0 m, range: [-1, 1]}}
modes: {only: {MORE}}
"""
OBSERVER = """observer: {kalman: {states: [z]}, A: {z: {z: 0 1/s}}, measures: {x_m: z}, F
  process_noise: {z: 1 m^2/s}, measurement_noise: {x_m: 1 m^2}}"""
RUNS = "runs: {of: model.only}"


def sampled(folder: Path, more: str) -> list[str]:
    project = project_of(
        folder, model=CONTINUOUS.replace("MORE", ""), sampled=SAMPLED.replace("MORE", more)
    )
    return problem_lines(lambda: load_automaton("sampled", project))


def continuous(more: str) -> list[str]:
    return problem_lines(lambda: automaton(CONTINUOUS.replace("MORE", more)))


@pytest.mark.parametrize("more", ["", "update: {x: 0 m}", OBSERVER.replace("F", ""), RUNS])
def test_a_sampled_mode_updates_observes_or_runs(tmp_path: Path, more: str) -> None:
    assert sampled(tmp_path, more) == []


def test_what_belongs_to_the_other_kind_of_automaton_is_refused(tmp_path: Path) -> None:
    assert sampled(tmp_path, "flow: {x: der(x) = 3 m/s}")
    assert continuous("update: {x: 0 m}")


@pytest.mark.parametrize("more", [RUNS, OBSERVER.replace("F", "")])
def test_a_continuous_mode_neither_runs_nor_observes(more: str) -> None:
    assert continuous(more)


def test_a_mode_does_not_observe_and_run_at_once(tmp_path: Path) -> None:
    assert sampled(tmp_path, f"{RUNS}, {OBSERVER.replace('F', '')}")


def test_f_reads_no_state_of_its_observer(tmp_path: Path) -> None:
    assert sampled(tmp_path, OBSERVER.replace("F", "f: {z: x * 1 1/s},")) == []
    assert sampled(tmp_path, OBSERVER.replace("F", "f: {z: z * 1 1/s},"))
