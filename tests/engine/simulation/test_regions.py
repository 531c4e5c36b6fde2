"""The gap of the driveline as a parallel region: the same drive as with the gap in the chart."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import modewright as mw
from modewright.api.simulation import load

PLANT = Path(__file__).parents[3] / "spec" / "ev_driveline" / "plant.yaml"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Write the driveline with its modes moved into a region `gap`, and the ideal system."""
    text = PLANT.read_text().replace("automaton: driveline", "automaton: driveline_beside")
    head, modes = text.split("initial: drive_contact\n")
    modes, rest = modes.split("elements:")
    _, outputs = rest.split("outputs:")
    inside = "".join(f"    {line}\n" for line in modes.splitlines())
    region = f"regions:\n  gap:\n    initial: drive_contact\n{inside}"
    spec = tmp_path / "spec"
    spec.mkdir()
    (spec / "plant.yaml").write_text(f"{head}{region}outputs:{outputs}")
    for name in ("driveline", "driveline_beside"):
        (spec / f"{name}_system.yaml").write_text(
            f"language: 1\nsystem: {name}_system\ninputs: {{T_req: {{unit: N*m}}}}\n"
            f"instances: {{plant: {{of: {name}}}}}\nconnections: {{plant.T_em: T_req}}\n"
        )
        (spec / f"{name}_tip_out.yaml").write_text(
            f"language: 1\nscenario: {name}_tip_out\nof: {name}_system\nhorizon: 2.5 s\n"
            "initial: {plant.theta_d: 0.0740754719736 rad}\n"
            "inputs: {T_req: {start: 30 N*m, steps: {0.4785 s: -20 N*m}}}\n"
        )
    return tmp_path


def test_a_gap_beside_the_chart_moves_as_the_gap_in_it(folder: Path) -> None:
    chart, beside = (
        mw.simulate(f"{name}_system", f"{name}_tip_out", root=folder)
        for name in ("driveline", "driveline_beside")
    )
    assert len(chart.events) == 10
    moves = [(event.time, event.source, event.target) for event in chart.events]
    assert [(event.time, event.source, event.target) for event in beside.events] == moves
    assert {event.region for event in beside.events} == {"gap"}
    for name in ("w_em", "w_w", "T_hs", "theta_d", "theta_b"):
        np.testing.assert_array_equal(
            chart.signals[f"plant.{name}"], beside.signals[f"plant.{name}"], err_msg=name
        )
    np.testing.assert_array_equal(beside.signals["plant.gap"], chart.signals["plant.mode"])


def test_an_automaton_without_modes_has_one(folder: Path) -> None:
    used = load("driveline_beside_system", "driveline_beside_tip_out", root=folder).system
    automaton = used.instances["plant"].automaton
    assert [mode.name for mode in automaton.modes.values()] == ["always"]
    assert [region.name for region in automaton.all_regions] == ["chart", "gap"]


FOLLOWER = """\
language: 1
automaton: follower
period: 1 ms
numbers: float64
model: driveline_beside
inputs: {T_em: {unit: N*m, range: [-400, 400]}, w_start: {unit: rad/s, range: [0, 400]}}
states:
  w_w:     {initial: 40 km/h / r_w, range: [-50, 300]}
  w_em:    {initial: w_w * R, range: [-400, 2400]}
  theta_d: {initial: 0.0740754719736 rad, range: [-0.5, 0.5]}
  theta_b: {initial: alpha, range: [-0.2, 0.2]}
equations: {is_free: in(driveline_beside.gap.no_contact)}
modes:
  going: {runs: {of: driveline_beside.always, method: rk4, substeps: 4, events: 8}}
outputs: [w_w, w_em, theta_d, theta_b, is_free, mode]
"""
SYSTEM = """\
language: 1
system: both
inputs: {T_req: {unit: N*m}}
instances: {plant: {of: driveline_beside}, est: {of: follower}}
connections: {plant.T_em: T_req, est.T_em: T_req, est.w_start: plant.w_w}
"""


def test_a_run_follows_the_regions_of_its_model(folder: Path) -> None:
    spec = folder / "spec"
    (spec / "follower.yaml").write_text(FOLLOWER)
    (spec / "both.yaml").write_text(SYSTEM)
    (spec / "both_tip_out.yaml").write_text(
        "language: 1\nscenario: both_tip_out\nof: both\nhorizon: 2.5 s\n"
        "initial: {plant.theta_d: 0.0740754719736 rad}\n"
        "inputs: {T_req: {start: 30 N*m, steps: {0.479 s: -20 N*m}}}\n"
    )
    trajectory, verdicts = mw.lockstep("both", "both_tip_out", root=folder)
    assert [verdict.differing for verdict in verdicts] == [0, 0]
    moved = [event for event in trajectory.events if event.instance == "plant"]
    assert len(moved) == 10
    signals = trajectory.signals
    for name, tolerance in (("w_w", 1e-7), ("w_em", 1e-5), ("theta_d", 1e-7)):
        off = np.abs(signals[f"plant.{name}"] - signals[f"est.{name}"])
        assert off.max() < tolerance, (name, off.max())
    free = signals["plant.gap"] == 0
    assert (signals["est.is_free"] == free).mean() > 0.999
    assert 0.01 < free.mean() < 0.99


def test_a_run_refuses_a_model_whose_regions_act(folder: Path) -> None:
    spec = folder / "spec"
    (spec / "follower.yaml").write_text(FOLLOWER)
    assert not [p for p in mw.check("follower", root=folder) if p.severity == "error"]
    plant = (spec / "plant.yaml").read_text()
    acting = plant.replace(
        "      no_contact:\n", "      no_contact:\n        exit: {theta_b: 0 rad}\n"
    )
    assert acting.count("exit:") == 1
    (spec / "plant.yaml").write_text(acting)
    errors = [p.label for p in mw.check("follower", root=folder) if p.severity == "error"]
    assert errors == [
        "a run inside a tick carries states alone: `driveline_beside` has entry or exit actions"
    ]


TWO = """\
language: 1
automaton: two
period: 1 ms
numbers: float64
inputs: {u: {unit: "1", range: [-10, 10]}}
initial: low
modes: {low: {transitions: {high: {when: u >= 1}}}, high: {}}
regions:
  lamp: {initial: dark, modes: {dark: {transitions: {lit: {when: u >= 2}}}, lit: {}}}
outputs: [mode]
"""
MAP = """\
language: 1
map: column
time: {column: t, unit: s}
columns: {u: {to: u, unit: "1"}}
"""


def test_a_replay_tells_the_transitions_of_all_regions(tmp_path: Path) -> None:
    spec = tmp_path / "spec"
    spec.mkdir()
    (spec / "two.yaml").write_text(TWO)
    (spec / "column.yaml").write_text(MAP)
    recording = tmp_path / "u.csv"
    recording.write_text("t,u\n0,0\n0.001,1\n0.002,2\n0.003,0\n")
    found = mw.replay("two", recording, "column", root=tmp_path)
    run = found.result.trajectory
    moves = [(e.time, e.region, e.source, e.target) for e in run.events]
    assert moves == [(0.001, "chart", "low", "high"), (0.002, "lamp", "dark", "lit")]
    assert run.signals["lamp"].tolist() == [0, 0, 1, 1]
    assert run.modes == {"mode": {0: "low", 1: "high"}, "lamp": {0: "dark", 1: "lit"}}
    assert found.verdict is not None and found.verdict.is_equal
