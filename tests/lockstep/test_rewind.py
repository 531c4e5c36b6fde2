"""Rewind in lock-step: transitions that go back, of runs and observers, under random inputs."""

from __future__ import annotations

import dataclasses
from collections import Counter
from random import Random

import pytest

from engine.interpreter.interpreter import Interpreter
from language.ir.number_type import NUMBER_TYPES
from language.ir.program import Program
from language.loading.load import load_automaton, program_of
from language.overlays.expand_document import Project
from lockstep.tick_log import TickLog
from tests.language.spec_builders import ROOT
from tests.lockstep.program_strategies import Tick
from tests.lockstep.random_specs.combined_executable import Batch

TICKS = 1500
LANE = """\
language: 1
automaton: lane
parameters: {lag: {value: 2 s}}
inputs: {v: {unit: m/s, range: [0, 9]}}
states: {x: {unit: m, initial: 1 m, range: [-9, 9]}}
initial: down
modes:
  down: {flow: {x: lag * der(x) = -v * 2 s - 0.25 * x}}
  up: {flow: {x: lag * der(x) = v * 2 s - 0.25 * x}}
outputs: [x]
"""
TURNER = """\
language: 1
automaton: turner
period: 0.125 s
numbers: float64
model: lane
inputs:
  v: {unit: m/s, range: [0, 9]}
  z: {unit: m, range: [-9, 9]}
  gear: {type: int, range: [0, 7]}
  go: {type: bool}
states: {x: {initial: 1 m, range: [-4, 4]}}
discrete:
  was: {unit: m, initial: 0 m, range: [-9, 9]}
  last: {type: int, initial: 0, range: [0, 7]}
equations: {far: "if gear > 3 then 2 * x else x"}
initial: down
modes:
  down:
    ADVANCE
    exit: {was: far}
    transitions:
      up:
        when: WHEN
        priority: 1
        rewind: {until: UNTIL or (go and gear > 3), within: 0.5 s}
        reset: {x: x + 0.25 m}
      again:
        to: up
        when: x < -3 m
        wait: 0.25 s
        priority: 2
        rewind: {until: x < -2 m, within: 0.125 s}
  up:
    runs: {of: lane.up, method: METHOD}
    entry: {last: gear}
    transitions: {down: {when: x > 0.5 mBACK}}
outputs: [x, far, was, last, mode, faults]
"""
OBSERVER = """observer:
      of: lane.down
      kalman: {states: [x], gain: steady}
      at: {x: 0 m}
      measures: {z: x}
      process_noise: {x: 2 m^2/s}
      measurement_noise: {z: 1 m^2}"""
BACK = ", rewind: {until: x >= 0 m, within: 0.7 s}"
LOW = ("far < -0.5 m", "far <= 0 m")
FAST = ("v > 1.5 m/s", "v > 0.75 m/s")
SPECS = {
    "by_rk4": ("runs: {of: lane.down, method: rk4, follow: false}", "rk4", LOW),
    "by_exponential": ("runs: {of: lane.down, method: exponential}", "exponential", LOW),
    "observed": (OBSERVER, "midpoint", LOW),
    "standing": ("update: {was: z}", "exact", FAST),
}
"""What advances the source, the method of the runs, guard and `until`."""
RUN = {"on a tick"}
LACKING = {
    "standing": {"inside a tick"},
    "by_rk4": RUN,
    "by_exponential": RUN,
    "hko": {"more ticks"},
}
"""What one tick back cannot bring about: without a flow, or without corrections."""
SEEN = {"limit", "one tick", "more ticks", "on a tick", "inside a tick"}


def inputs(name: str) -> list[Tick]:
    """Return inputs that let x cross on ticks, between them and not at all for a while."""
    draw, found, z = Random(name), [], 1.0
    speed = draw.uniform(0.0, 2.0)
    for tick in range(TICKS):
        if tick % 12 == 0:
            speed = draw.choice((0.0, -0.0, 0.5, 1.0, 5e-324, 9.5, draw.uniform(0.0, 3.0)))
        z = draw.uniform(-2.0, 2.0) if draw.random() < 0.2 else z
        flags = {"input.go": draw.random() < 0.5, "is_new.z": draw.random() < 0.7}
        found.append({"input.v": speed, "input.z": z, "input.gear": draw.randrange(8), **flags})
    return found


def drive(name: str) -> list[Tick]:
    """Return what an estimator of the driveline sees: torque about 0, speeds that rattle."""
    draw, found, rate, twist = Random(name), [], 0.0, 0.0
    torque = 20.0
    for tick in range(TICKS):
        if tick % 150 == 0:
            torque = draw.uniform(-40.0, 40.0)
        rate += (0.02 * torque - 8.0 * max(abs(twist) - 0.02, 0.0) * (1 if twist > 0 else -1)) * 0.1
        twist = max(-0.2, min(0.2, twist + rate * 1e-3))
        found.append(
            {
                "input.T_em": torque,
                "input.y_w": 38.0 + draw.gauss(0.0, 0.05),
                "input.y_em": (38.0 + rate) * 8.1 + draw.gauss(0.0, 0.3),
                "is_new.y_em": tick % 10 == 0,
                "is_new.y_w": tick % 10 == 0,
            }
        )
    return found


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Program]:
    """Return each spec in both number types."""
    home = tmp_path_factory.mktemp("rewind")
    (home / "spec").mkdir()
    (home / "spec" / "lane.yaml").write_text(LANE)
    found = {}
    for name, (advance, method, (when, until)) in SPECS.items():
        back = BACK if name == "by_rk4" else ""
        new = {"ADVANCE": advance, "METHOD": method, "BACK": back, "WHEN": when, "UNTIL": until}
        text = TURNER.replace("turner", name)
        for old in new:
            text = text.replace(old, new[old])
        (home / "spec" / f"{name}.yaml").write_text(text)
    for name, root in (*((name, home) for name in SPECS), ("hko", ROOT)):
        automaton = load_automaton(name, Project(root))
        for number in NUMBER_TYPES:
            made = program_of(dataclasses.replace(automaton, numbers=number))
            found[f"{name}_{number}"] = dataclasses.replace(made, name=f"{name}_{number}")
    return found


@pytest.fixture(scope="module")
def batch(programs: dict[str, Program], tmp_path_factory: pytest.TempPathFactory) -> Batch:
    return Batch(list(programs.values()), tmp_path_factory.mktemp("batch"))


def taped(program: Program, ticks: list[Tick]) -> tuple[TickLog, Counter[str]]:
    """Return the tape, and how often a transition went back how."""
    stepper, tape, seen = Interpreter(program), TickLog(program, program.name), Counter[str]()
    back = {info.number for info in program.transitions if info.rewind_ticks}
    for tick in ticks:
        for name, value in tick.items():
            if stepper.has(name):
                stepper.set(name, value)
        stepper.run("step")
        tape.record_tick(stepper)
        if stepper.get("memory.fired") in back:
            count = stepper.get("work.ticks_back")
            seen["limit" if not count else "one tick" if count == 1 else "more ticks"] += 1
            if count == 1:  # else the runs of later ticks have overwritten it
                seen["inside a tick" if stepper.get("work.rest") > 0.0 else "on a tick"] += 1
    return tape, seen


@pytest.mark.parametrize("number", NUMBER_TYPES)
@pytest.mark.parametrize("name", [*SPECS, "hko"])
def test_what_goes_back_is_equal_in_c(
    programs: dict[str, Program], batch: Batch, name: str, number: str
) -> None:
    program = programs[f"{name}_{number}"]
    tape, seen = taped(program, drive(name) if name == "hko" else inputs(name))
    verdict = batch.verdict(tape)
    assert verdict.is_equal, str(verdict.first)
    assert {what for what, count in seen.items() if count} == SEEN - LACKING.get(name, set()), seen
