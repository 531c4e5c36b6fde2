"""Signals: what is recorded changes nothing; noise is seeded; samples are new once."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import modewright as mw
from engine.interpreter.interpreter import Stepper
from engine.simulation.sensors import FirstOrderLag, noise_stream
from engine.simulation.simulate import simulate
from language.ir.program import Program
from language.loading.scenario_reader import read_scenario
from language.loading.system_reader import read_system
from language.overlays.expand_document import Project, read_document
from tests.language.spec_builders import project_of

SENSED = """language: 1
system: sensed
inputs: {T_req: {unit: N*m}}
instances: {plant: {of: driveline}, est: {of: estimator}}
sensors:
  s_em: {of: plant.w_em, filter: {lag: 0.5 ms}, noise: {sd: 0.3 rad/s}, quantise: 1 rpm,
    sample: 1 ms}
  s_w:  {of: plant.w_w, filter: {lag: 10 ms}, delay: 5 ms, noise: {sd: 0.05 rad/s},
    sample: {period: 10 ms, offset: 3 ms}}
connections: {plant.T_em: T_req, est.y_em: s_em, est.y_w: s_w, est.T_em: "delay(T_req, 1 ms)"}
outputs: {error: est.T_hs - plant.T_hs}
"""
RUN = """language: 1
scenario: {name}
of: {of}
horizon: 0.75 s
seed: {seed}
initial: {{plant.theta_d: 0.0740754719736 rad}}
inputs: {{T_req: {{start: 30 N*m, ramp: {{from: 0.4785 s, to: 0.49 s, value: -20 N*m}}}}}}
record: {{every: {every}}}
"""


def run(name: str, every: str, seed: int = 1, of: str = "sensed") -> str:
    return RUN.format(name=name, every=every, seed=seed, of=of)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    project_of(
        tmp_path,
        sensed=SENSED,
        often=run("often", "0.31 ms"),
        seldom=run("seldom", "25 ms"),
        other=run("other", "25 ms", seed=2),
        bare=run("bare", "0.31 ms", of="ev_driveline_ideal"),
        bare_seldom=run("bare_seldom", "25 ms", of="ev_driveline_ideal"),
    )
    return tmp_path


@pytest.mark.parametrize("system", ["sensed", "ev_driveline_ideal"])
def test_what_is_recorded_has_no_influence(folder: Path, system: str) -> None:
    names = ("often", "seldom") if system == "sensed" else ("bare", "bare_seldom")
    often, seldom = (mw.simulate(system, name, root=folder) for name in names)
    assert often.events == seldom.events and len(often.events) > 6
    shared = [(i, j) for j, t in enumerate(seldom.times) for i in np.flatnonzero(often.times == t)]
    assert len(shared) >= 1
    for signal, values in seldom.signals.items():
        assert all(often.signals[signal][i] == values[j] for i, j in shared), signal


def test_rows_between_the_steps_are_as_exact_as_the_steps(folder: Path) -> None:
    """The same run with a step of 0.05 ms: rows inside steps of 0.25 ms differ by its error."""
    coarse = mw.simulate("ev_driveline_ideal", "bare", root=folder)
    fine = "language: 1\nvariant: fine\nextends: driveline\nstep: 0.05 ms\n"
    rig = "language: 1\nvariant: rig\nextends: ev_driveline_ideal\ninstances: {plant: {of: fine}}\n"
    project_of(folder, fine=fine, rig=rig)
    exact = mw.simulate("rig", "bare", root=folder)
    near = np.zeros(len(exact.times), dtype=bool)
    for event in exact.events:
        near |= np.abs(exact.times - event.time) < 2e-6
    for signal in ("plant.w_em", "plant.T_hs", "plant.theta_b"):
        reference = exact.signals[signal]
        difference = np.abs(coarse.signals[signal] - reference)[~near]
        assert difference.max() <= 1e-7 * np.abs(reference).max(), signal


def test_noise_is_the_same_for_the_same_seed_and_another_for_another(folder: Path) -> None:
    first, again = (mw.simulate("sensed", "seldom", root=folder) for _ in range(2))
    other = mw.simulate("sensed", "other", root=folder)
    assert first.csv() == again.csv()
    assert not np.array_equal(first.signals["s_em"], other.signals["s_em"])
    assert np.array_equal(first.signals["plant.w_em"], other.signals["plant.w_em"])


def test_the_noise_of_a_sensor_does_not_depend_on_the_others() -> None:
    stream, other = noise_stream(1, "s_em"), noise_stream(1, "s_w")
    numbers = np.array([next(stream) for _ in range(20_000)])
    others = np.array([next(other) for _ in range(20_000)])
    assert abs(numbers.mean()) < 5 / np.sqrt(20_000)
    assert abs(numbers.std() - 1.0) < 5 / np.sqrt(2 * 20_000)
    assert abs(np.mean(numbers * others)) < 5 / np.sqrt(20_000)
    again = noise_stream(1, "s_em")
    assert [next(again) for _ in range(5)] == numbers[:5].tolist()


def test_a_measured_input_is_new_at_the_ticks_that_a_sample_precedes(folder: Path) -> None:
    project = Project(folder)
    system = read_system(read_document(project.path_of("sensed")), project)
    scenario = read_scenario(read_document(project.path_of("seldom")), project, system)
    flags: dict[str, list[bool]] = {"y_em": [], "y_w": []}

    def ticked(_: str, program: Program, stepper: Stepper) -> None:
        for name, found in flags.items():
            found.append(stepper.get(f"is_new.{name}"))

    simulate(system, scenario, on_tick=ticked)
    assert all(flags["y_em"])
    assert [k for k, new in enumerate(flags["y_w"][:40]) if new] == [3, 13, 23, 33]


def test_engine_and_c_are_equal_behind_sensors_and_delays(folder: Path) -> None:
    trajectory, verdicts = mw.lockstep("sensed", "seldom", root=folder)
    assert trajectory.stopped is None
    assert [(v.name, v.differing) for v in verdicts] == [("est", 0), ("plant", 0)]
    assert verdicts[0].transitions >= 4


def test_a_lag_is_exact_for_a_ramp_however_it_is_cut() -> None:
    """y = t - L (1 - e^(-t / L)) for the input t, from rest."""
    for cuts in (1, 7, 100):
        lag = FirstOrderLag(Fraction(1, 5))
        for k in range(cuts + 1):
            lag.advance(Fraction(k, cuts), k / cuts)
        exact = 1.0 - 0.2 * (1.0 - np.exp(-5.0))
        assert abs(lag.evaluate(Fraction(1), 1.0) - exact) < 1e-14


def test_a_scenario_of_an_automaton_needs_no_system(tmp_path: Path) -> None:
    tip = run("tip", "25 ms", of="driveline").replace("plant.", "").replace("T_req", "T_em")
    project_of(tmp_path, tip=tip)
    alone = mw.simulate("driveline", "tip", root=tmp_path)
    assert [e.transition for e in alone.events][:2] == ["no_contact", "coast_contact"]
    assert mw.check("tip", tmp_path) == []
    project_of(tmp_path, bare=run("bare", "25 ms", of="ev_driveline_ideal"))
    beside = mw.simulate("ev_driveline_ideal", "bare", root=tmp_path)
    times = [e.time for e in beside.events_of("plant")]
    assert np.allclose([e.time for e in alone.events], times, rtol=0, atol=1e-9)
