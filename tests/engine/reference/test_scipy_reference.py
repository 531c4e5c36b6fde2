"""Reference: our engine against scipy and filterpy, and those against closed forms."""

from __future__ import annotations

import csv
import dataclasses
import itertools
import math
from collections.abc import Callable, Collection
from pathlib import Path

import numpy as np
import pytest

from engine.execution.event_loop import SimulationStopped
from engine.interpreter.interpreter import Interpreter
from engine.reference.scipy_reference import (
    reference_numbers,
    reference_stepper,
    simulate_reference,
    with_reference_numbers,
)
from engine.reference.scipy_stepper import INTEGRATION_BLOCKS, ScipyStepper, without_integration
from engine.results.sampled_run import Event
from engine.results.trajectory import Trajectory
from engine.simulation import instance_programs as starting
from engine.simulation.instance_programs import programs_of
from engine.simulation.simulate import simulate
from language.ir.number_type import NUMBER_TYPES, NumberType
from language.ir.program import Program
from language.loading.load import program_of
from language.loading.scenario_reader import read_scenario
from language.loading.system_reader import read_system
from language.model.automaton import Automaton
from language.model.system import Scenario, System
from language.overlays.expand_document import Project, read_document
from modewright.api.simulation import program
from tests.engine.finite_escape import RUNAWAY

Alone = Callable[[str, str], tuple[System, Scenario]]

ROOT = Path(__file__).parents[3]
PUBLISHED = ROOT / "tests/data/paper/truth_tip_out_events.csv"
EVENT_TOLERANCE = 1e-8
"""Our method is of fourth order; at its step of 0.25 ms its events are some 5e-11 s off."""
SIGNAL_TOLERANCE = 1e-6
"""Of the largest value; the fastest signal, w_b inside the gap (343 1/s), is some 1.4e-7 off."""
AWAY = 2e-6
"""Around an event [s], a sample may fall on either side of it."""
EXACT_TOLERANCE = 1e-12
"""Events with a closed form [s]: rounding of the states over their rates, some 1e-15 s."""
NUMBERS_TOLERANCE = 1e-9
"""Of the largest entry: what rule 17f promises of our matrix routines."""

BALL = """language: 1
automaton: ball
step: 1 ms
parameters:
  g: {value: 9.81 m/s^2}
  e: {value: 0.8}
states:
  z: {unit: m, initial: 1.3 m}
  v: {unit: m/s, initial: 0 m/s}
flow:
  z: der(z) = v
  v: der(v) = -g
initial: flight
modes:
  flight:
    number: 0
    transitions:
      bounce: {to: flight, when: z <= 0 m and v < 0 m/s, reset: {z: 0 m, v: -e * v}}
outputs: [z, v]
"""
DECAY = """language: 1
automaton: decay
step: 1 ms
parameters: {tau: {value: 0.37 ms}, low: {value: 0.2 V}, t_wait: {value: 12.3 ms}}
states: {u: {unit: V, initial: 5 V}}
flow: {u: tau * der(u) = -u}
initial: high
modes:
  high: {number: 0, transitions: {low: {when: u < low, wait: t_wait}}}
  low: {number: 1}
outputs: [u, mode]
"""
PULSE = """language: 1
automaton: pulse
step: 10 ms
parameters: {top: {value: 4.9e-5 m}}
states: {z: {unit: m, initial: 0 m}, v: {unit: m/s, initial: 0.04 m/s}}
flow: {z: der(z) = v, v: der(v) = -16 m/s^2}
initial: below
modes:
  below: {number: 0, transitions: {above: {when: z > top}}}
  above: {number: 1}
outputs: [z, mode]
"""


@pytest.fixture(scope="module")
def tip_out() -> tuple[System, Scenario]:
    project = Project(ROOT)
    system = read_system(read_document(project.path_of("ev_driveline_ideal")), project)
    scenario = read_scenario(read_document(project.path_of("tip_out")), project, system)
    return system, scenario


@pytest.fixture(scope="module")
def ours(tip_out: tuple[System, Scenario]) -> Trajectory:
    return simulate(*tip_out)


@pytest.fixture(scope="module")
def theirs(tip_out: tuple[System, Scenario]) -> Trajectory:
    return simulate_reference(*tip_out)


@pytest.fixture
def alone(tmp_path: Path) -> Alone:
    """Return a function that makes a system of one automaton and its scenario."""

    def made(text: str, horizon: str) -> tuple[System, Scenario]:
        name = text.splitlines()[1].removeprefix("automaton: ")
        system = f"language: 1\nsystem: alone\ninstances: {{one: {{of: {name}}}}}\n"
        scenario = f"language: 1\nscenario: run\nof: alone\nhorizon: {horizon}\n"
        folder = tmp_path / "spec"
        folder.mkdir()
        for file, content in {"a": text, "s": system, "r": scenario}.items():
            (folder / f"{file}.yaml").write_text(content, "utf-8")
        project = Project(tmp_path)
        read = read_system(read_document(folder / "s.yaml"), project)
        return read, read_scenario(read_document(folder / "r.yaml"), project, read)

    return made


def sequence(events: tuple[Event, ...]) -> list[tuple[str, str, str]]:
    return [(event.transition, event.source, event.target) for event in events]


def largest_gap(first: tuple[Event, ...], second: tuple[Event, ...]) -> float:
    return max(abs(a.time - b.time) for a, b in zip(first, second, strict=True))


def blank_motion(automaton: Automaton, varying: Collection[str] = ()) -> Program:
    """Return the Program of an automaton, with nothing in its blocks that integrate or locate."""
    program = program_of(automaton, varying)
    if program.period is not None:
        return program
    blocks = {n: () if n.startswith(INTEGRATION_BLOCKS) else b for n, b in program.blocks.items()}
    return dataclasses.replace(program, blocks=blocks)


def test_events_of_the_plant_agree(ours: Trajectory, theirs: Trajectory) -> None:
    mine, other = ours.events_of("plant"), theirs.events_of("plant")
    assert len(mine) == 10
    assert sequence(mine) == sequence(other)
    assert largest_gap(mine, other) < EVENT_TOLERANCE


def test_transitions_of_the_estimator_are_the_same(ours: Trajectory, theirs: Trajectory) -> None:
    assert ours.events_of("est") == theirs.events_of("est")
    assert len(ours.events_of("est")) == 10


def test_signals_agree_away_from_events(ours: Trajectory, theirs: Trajectory) -> None:
    assert np.array_equal(ours.times, theirs.times)
    assert ours.signals.keys() == theirs.signals.keys()
    events = np.array([event.time for event in theirs.events_of("plant")])
    away = np.min(np.abs(ours.times[:, None] - events), axis=1) > AWAY
    for name, values in theirs.signals.items():
        error = np.max(np.abs(ours.signals[name] - values)[away])
        assert error <= SIGNAL_TOLERANCE * np.max(np.abs(values)), name


def test_events_agree_with_the_independent_reproduction_of_the_paper(theirs: Trajectory) -> None:
    with PUBLISHED.open(newline="") as file:
        rows = [(float(r["t"]), int(r["from"]), int(r["to"])) for r in csv.DictReader(file)]
    numbers = {name: number for number, name in theirs.modes["plant.mode"].items()}
    events = theirs.events_of("plant")
    assert [(numbers[e.source], numbers[e.target]) for e in events] == [row[1:] for row in rows]
    assert max(abs(e.time - row[0]) for e, row in zip(events, rows, strict=True)) < 1e-6


def test_our_engine_comes_nearer_with_the_fourth_power_of_its_step(
    tip_out: tuple[System, Scenario], ours: Trajectory, theirs: Trajectory
) -> None:
    system, scenario = tip_out
    plant = system.instances["plant"]
    fine = dataclasses.replace(plant.automaton, step=plant.automaton.step / 2)
    instances = {**system.instances, "plant": dataclasses.replace(plant, automaton=fine)}
    finer = simulate(dataclasses.replace(system, instances=instances), scenario)
    right = theirs.events_of("plant")
    gaps = [largest_gap(run.events_of("plant"), right) for run in (ours, finer)]
    assert 3.5 < math.log2(gaps[0] / gaps[1]) < 4.5


def test_a_bouncing_ball_bounces_when_the_formula_says(alone: Alone) -> None:
    run = simulate_reference(*alone(BALL, "3 s"))
    fall = math.sqrt(2 * 1.3 / 9.81)
    flights = [fall, *(2 * fall * 0.8**k for k in range(1, 8))]
    expected = [time for time in itertools.accumulate(flights) if time <= 3]
    times = [event.time for event in run.events]
    assert len(expected) > 4
    assert times == pytest.approx(expected, abs=EXACT_TOLERANCE)


def test_a_decay_faster_than_its_step_switches_when_the_formula_says(alone: Alone) -> None:
    run = simulate_reference(*alone(DECAY, "20 ms"))
    expected = 0.37e-3 * math.log(5 / 0.2) + 12.3e-3
    assert [event.time for event in run.events] == pytest.approx([expected], abs=EXACT_TOLERANCE)
    exact = 5 * np.exp(-run.times / 0.37e-3)
    assert run.signals["one.u"] == pytest.approx(exact, rel=0, abs=1e-9)


def test_a_pulse_inside_a_step_is_seen(alone: Alone) -> None:
    run = simulate_reference(*alone(PULSE, "20 ms"))
    expected = (0.04 - math.sqrt(0.04**2 - 2 * 16 * 4.9e-5)) / 16
    assert [event.time for event in run.events] == pytest.approx([expected], abs=EXACT_TOLERANCE)


def test_a_state_that_grows_without_bound_stops_the_run_with_its_place(alone: Alone) -> None:
    run = simulate_reference(*alone(RUNAWAY, "1 s"))
    assert run.stopped is not None
    assert "`runaway` in mode `only`" in run.stopped
    assert run.times[-1] == pytest.approx(0.1, abs=2e-3)


def test_a_start_that_is_not_finite_is_refused_by_name(alone: Alone) -> None:
    stepper = ScipyStepper(programs_of(*alone(BALL, "1 s"))["one"])
    stepper.run("start")
    stepper.set("state.v", math.nan)
    stepper.set("work.h", 1e-3)
    with pytest.raises(
        SimulationStopped, match=r"t = 0 s, `ball` in mode `flight`: state `z` is 1\.3, its r"
    ):
        stepper.run("flow")


def test_no_block_of_ours_that_integrates_or_locates_is_kept(
    tip_out: tuple[System, Scenario],
) -> None:
    program = programs_of(*tip_out)["plant"]
    kept = without_integration(program).blocks
    verbs = {name.partition("_")[0] for name in program.blocks if name not in kept}
    assert verbs == {
        "flow",
        "dense",
        "peek",
        "point",
        "step",
        "series",
        "locate",
        "segment",
        "macro",
    }
    assert set(kept) >= {"init", "start", "equations", "evaluate_guards", "jump"}


@pytest.mark.long
def test_the_result_is_the_same_without_our_motion(
    tip_out: tuple[System, Scenario], theirs: Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(starting, "program_of", blank_motion)
    again = simulate_reference(*tip_out)
    assert again.events == theirs.events
    assert again.csv() == theirs.csv()
    assert simulate(*tip_out).events != theirs.events


def test_solved_numbers_agree_with_the_libraries(tip_out: tuple[System, Scenario]) -> None:
    program = programs_of(*tip_out)["est"]
    mine = {constant.name: constant.value for constant in program.constants}
    assert [info.mode for info in program.observers] == ["drive", "coast"]
    for info in program.observers:
        other = reference_numbers(info)
        for letter in ("Phi", "Gamma", "G", "L"):
            names = [name for name in other if name.startswith(f"solved.{info.mode}_{letter}.")]
            largest = max(abs(other[name]) for name in names)
            for name in names:
                assert abs(mine[name] - other[name]) <= NUMBERS_TOLERANCE * largest, name


def test_solved_numbers_of_ours_are_not_used(tip_out: tuple[System, Scenario]) -> None:
    program = programs_of(*tip_out)["est"]
    solved = {name for info in program.observers for name in info.solved}
    spoiled = tuple(
        dataclasses.replace(c, value=math.nan) if c.name in solved else c for c in program.constants
    )
    assert any(c.name in solved for c in program.constants)
    again = with_reference_numbers(dataclasses.replace(program, constants=spoiled))
    assert again.constants == with_reference_numbers(program).constants


def test_a_number_taken_as_zero_that_is_not_is_refused(tip_out: tuple[System, Scenario]) -> None:
    info = programs_of(*tip_out)["est"].observers[0]
    missing = "solved.drive_L.w_em.y_em"
    solved = {name: value for name, value in info.solved.items() if name != missing}
    with pytest.raises(ValueError, match=f"{missing} is 0 in the Program, 0\\.22"):
        reference_numbers(dataclasses.replace(info, solved=solved))


TURN = """language: 1
automaton: turn
period: 1 ms
numbers: {numbers}
inputs: {{u: {{unit: 1, range: [-1.0e30, 1.0e30]}}}}
equations: {{s: sin(u * 1 rad), c: cos(u * 1 rad), t: tan(u * 1 rad), h: tanh(u)}}
outputs: [s, c, t, h]
"""


@pytest.mark.parametrize("number", NUMBER_TYPES)
def test_elementary_functions_are_those_of_numpy(number: NumberType, tmp_path: Path) -> None:
    """The engine agrees within its stated errors at any angle."""
    (tmp_path / "turn.yaml").write_text(TURN.format(numbers=number))
    made = program(str(tmp_path / "turn.yaml"))
    reference, engine = reference_stepper(made), Interpreter(made)
    real = np.float64 if number == "float64" else np.float32
    for u in (0.3, -999.0, 1002.0, 40000.0, -3.0e6, 1.0e22, -1.0e30):
        for stepper in (reference, engine):
            stepper.set("input.u", u)
            stepper.run("step")
        for name, function in (("s", np.sin), ("c", np.cos), ("t", np.tan), ("h", np.tanh)):
            found = reference.get(f"equation.{name}")
            assert found == float(function(real(u)))
            error = 4.0 * abs(found) * float(np.finfo(real).eps)
            assert abs(engine.get(f"equation.{name}") - found) <= error
