"""A tunable wait is kept in ticks: nothing else reads it, and no page changes it in a run."""

from __future__ import annotations

from pathlib import Path

from language.loading.calibration_page_reader import parse_pages
from language.loading.load import load_automaton
from language.loading.system_reader import read_system
from language.overlays.expand_document import read_document
from tests.language.spec_builders import problem_lines, project_of

PLANT = """language: 1
automaton: plant
parameters: {tau: {value: 20 ms, tunable: true, range: [1, 50]}}
inputs: {u: {unit: m}}
states: {x: {unit: m, initial: 0 m}}
flow: {x: tau * der(x) = u - x}
modes: {always: {}}
outputs: [x]
"""
RIDER = """language: 1
automaton: rider
period: 1 ms
numbers: float64
model: plant
inputs: {u: {unit: m, range: [-9, 9]}}
states: {x: {initial: 0 m, range: [-9, 9]}}
initial: a
modes:
  a: {runs: {of: plant.always, method: rk4}, transitions: {b: {when: x > 1 m, wait: tau}}}
  b: {}
outputs: [x]
"""
WAITER = """language: 1
automaton: waiter
period: 1 ms
numbers: float64
parameters: {t_on: {value: 5 ms, tunable: true}, low: {value: 1 m, tunable: true}}
inputs: {u: {unit: m, range: [-9, 9]}}
initial: a
modes: {a: {transitions: {b: {when: u > low, wait: t_on}}}, b: {}}
outputs: [mode]
"""
RIG = """language: 1
system: rig
inputs: {u: {unit: m}}
instances: {w: {of: waiter}}
connections: {w.u: u}
"""


def test_a_parameter_of_the_model_is_no_tunable_wait(tmp_path: Path) -> None:
    """The model would divide by ticks."""
    project = project_of(tmp_path, plant=PLANT, rider=RIDER)
    (line,) = problem_lines(lambda: load_automaton("rider", project))
    assert line.endswith("`tau` is a parameter of the model `plant`")


def test_no_page_changes_a_wait_while_a_system_runs(tmp_path: Path) -> None:
    project = project_of(tmp_path, waiter=WAITER, rig=RIG)
    system = read_system(read_document(project.path_of("rig")), project)
    assert parse_pages(["2 ms: w.low = 2 m"], system)
    (line,) = problem_lines(lambda: parse_pages(["2 ms: t_on = 2 ms"], system))
    (named,) = problem_lines(lambda: parse_pages(["2 ms: w.t_on = 2 ms"], system))
    for text in (line, named):
        assert text.endswith("`w.t_on` is a wait: it stays as it is while a system runs")
