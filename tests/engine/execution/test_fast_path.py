"""Cruise: major steps in which nothing happens are the same steps, whoever takes them."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import modewright as mw
from engine.execution.event_loop import ContinuousRun, PartialStep
from engine.results.trajectory import Trajectory
from tests.language.spec_builders import project_of

PLANT = """
language: 1
variant: coarse
extends: driveline
step: 2 ms
states: {w_em: {range: [-400, 310.6]}}
---
language: 1
system: plant_alone
inputs: {T_req: {unit: N*m}}
instances: {plant: {of: coarse}}
connections: {plant.T_em: T_req}
---
language: 1
scenario: pull
of: plant_alone
horizon: 0.3013 s
initial: {plant.theta_d: 0.074 rad}
inputs: {T_req: {start: 30 N*m, steps: {0.1013 s: -20 N*m}}}
record: {every: ROWS}
"""
"""Rows on and inside steps, or inside nearly all of them; an input that steps inside one, contact
lost and found again, and a range that is left for a while."""

TOGGLE = """language: 1
automaton: toggle
step: 50 ms
inputs: {u: {unit: "1"}}
equations: {twice: 2 * u}
initial: low
modes:
  low: {transitions: {high: {when: twice > 1}}}
  high: {transitions: {low: {when: twice < 1, wait: 120 ms}}}
outputs: [twice, mode]
"""
"""An automaton without states."""


def run(folder: Path, rows: str) -> Trajectory:
    (folder / "spec").mkdir(exist_ok=True)
    for number, text in enumerate(PLANT.split("---")):
        (folder / "spec" / f"{number}.yaml").write_text(text.replace("ROWS", rows))
    return mw.simulate("plant_alone", "pull", root=folder)


@pytest.mark.parametrize("rows", ["5 ms", "0.8 ms"])
def test_it_changes_no_bit_and_no_event(
    rows: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken: list[int] = []
    cruise_to = ContinuousRun._cruise_to

    def counted(flow: ContinuousRun, horizon: Fraction) -> PartialStep | None:
        before = flow.time
        found = cruise_to(flow, horizon)
        taken.append(int((flow.time - before) / flow.program.major_step))
        return found

    monkeypatch.setattr(ContinuousRun, "_cruise_to", counted)
    cruised = run(tmp_path, rows)
    assert sum(taken) > 20
    monkeypatch.setattr(ContinuousRun, "_cruise_to", lambda flow, horizon: None)
    walked = run(tmp_path, rows)
    assert [event.kind for event in cruised.events].count("transition") >= 3
    assert [event.kind for event in cruised.events].count("range") >= 2
    assert cruised.events == walked.events
    assert cruised.times.tobytes() == walked.times.tobytes()
    for name, values in cruised.signals.items():
        assert values.tobytes() == walked.signals[name].tobytes()
    assert np.isfinite(cruised.signals["plant.w_em"]).all()


@pytest.mark.parametrize("rows", ["10 ms", "33 ms", "50 ms", "130 ms"])
def test_an_automaton_without_states_has_rows_inside_its_steps(rows: str, tmp_path: Path) -> None:
    scenario = "language: 1\nscenario: toggled\nof: toggle\nhorizon: 1 s\n"
    scenario += "inputs: {u: {start: 0, steps: {0.31 s: 1, 0.5 s: 0}}}\n"
    project_of(tmp_path, toggle=TOGGLE, toggled=scenario + f"record: {{every: {rows}}}\n")
    found = mw.simulate("toggle", "toggled", root=tmp_path)
    assert [(event.kind, event.time) for event in found.events] == [
        ("transition", 0.31),
        ("transition", 0.62),
    ]
    expected = np.where((found.times >= 0.31) & (found.times < 0.5), 2.0, 0.0)
    assert found.signals["toggle.twice"].tolist() == expected.tolist()
    assert len(found.times) == int(1000 / int(rows.split()[0])) + 1
