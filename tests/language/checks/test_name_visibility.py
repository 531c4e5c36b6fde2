"""What random specs found: names and functions that every part of an automaton may use."""

from __future__ import annotations

from pathlib import Path

import modewright as mw

RANGES = 'u: {unit: "1", range: [-9, 9]}'
MEMORY = f"""\
language: 1
automaton: stages
period: 1 ms
numbers: float64
inputs: {{{RANGES}}}
states: {{x: {{unit: "1", initial: "0", range: [-9, 9]}}}}
discrete: {{k: {{type: int, initial: 0, range: [0, 9]}}}}
equations: {{was: previous(k)}}
initial: here
modes:
  here:
    exit: {{x: "previous(u * 2)"}}
    transitions: {{there: {{when: u > 1}}}}
  there:
    entry: {{x: "delay(u, 2 ms) + x"}}
    update: {{k: k + 1}}
    transitions: {{here: {{when: u < 1}}}}
outputs: [x, was, mode]
"""
REGIONS = f"""\
language: 1
automaton: pair
period: 1 ms
numbers: float64
inputs: {{{RANGES}}}
discrete: {{k: {{type: int, initial: 0, range: [0, 9]}}}}
initial: only
modes: {{only: {{update: {{k: k + 1}}}}}}
regions:
  side:
    initial: left
    modes: {{left: {{transitions: {{right: {{when: k > 1}}}}}}, right: {{}}}}
outputs: [k, mode]
"""
LANE = """\
language: 1
automaton: lane
inputs: {v: {unit: m/s, default: 1 m/s, range: [-1, 1]}}
states: {x: {unit: m, initial: 0 m, range: [-9, 9]}}
flow: {x: 1 s * der(x) = v * 1 s - x}
initial: only
modes: {only: {}}
outputs: [x]
"""
TABLE = """\
language: 1
automaton: rider
period: 10 ms
numbers: float64
model: lane
parameters: {curve: {table: {over: u, points: {-1: 2, 1: 3}}}}
inputs: {u: {unit: "1", range: [-9, 9]}, v: {unit: m/s, range: [-1, 1]}}
states: {x: {initial: 0 m, range: [-9, 9]}}
equations: {read: "lookup(curve, u)"}
initial: only
modes: {only: {runs: {of: lane.only, method: exponential}}}
outputs: [x, read]
"""
SCENARIO = """\
language: 1
scenario: run
of: %s
horizon: 6 ms
inputs: {u: {start: 0.5, steps: {2 ms: 3, 4 ms: 0.25}}}
record: {every: 1 ms}
"""


def spec(folder: Path, **texts: str) -> Path:
    (folder / "spec").mkdir()
    for name, text in texts.items():
        (folder / "spec" / f"{name}.yaml").write_text(text)
    return folder


def test_entry_and_exit_have_functions_with_memory(tmp_path: Path) -> None:
    """At 2 ms exit sets x = 2 * u(1 ms) = 1, entry adds u(0 ms) = 0.5 (rules 6 and 8)."""
    root = spec(tmp_path, stages=MEMORY, run=SCENARIO % "stages")
    trajectory, verdicts = mw.lockstep("stages", "run", root=root)
    assert list(trajectory.signals["stages.x"][:4]) == [0.0, 0.0, 1.5, 1.5]
    assert all(verdict.is_equal and verdict.transitions == 2 for verdict in verdicts)


def test_discrete_variables_are_delayed_like_states(tmp_path: Path) -> None:
    """`there` counts up at the end of 2 ms and 3 ms; k is read before that (rule 2)."""
    root = spec(tmp_path, stages=MEMORY, run=SCENARIO % "stages")
    trajectory = mw.simulate("stages", "run", root=root)
    assert list(trajectory.signals["stages.was"]) == [0, 0, 0, 0, 1, 2, 2]


def test_a_region_reads_discrete_variables(tmp_path: Path) -> None:
    root = spec(tmp_path, pair=REGIONS, run=SCENARIO % "pair")
    assert not [told for told in mw.check("pair", root) if told.severity == "error"]
    (event,) = mw.simulate("pair", "run", root=root).events
    assert (event.transition, event.time) == ("right", 0.002)


def test_an_automaton_with_a_table_runs_its_model_exponentially(tmp_path: Path) -> None:
    """dx/dt = (v - x) / s with v = 1 m/s for 10 ms: 1 - exp(-0.01)."""
    texts = {"lane": LANE, "rider": TABLE, "run": SCENARIO % "rider"}
    texts["run"] = texts["run"].replace("6 ms", "20 ms").replace("inputs: {", "inputs: {v: 1 m/s, ")
    trajectory = mw.simulate("rider", "run", root=spec(tmp_path, **texts))
    (place,) = [k for k, time in enumerate(trajectory.times) if abs(time - 0.01) < 1e-9][-1:]
    assert abs(trajectory.signals["rider.x"][place] - 0.009950166250831947) < 1e-12
