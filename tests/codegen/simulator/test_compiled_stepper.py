"""Compiled stepper: what runs a Program for the engine, with the bits of the interpreter."""

from __future__ import annotations

import dataclasses
from fractions import Fraction
from functools import partial

import pytest

from codegen.simulator.compiled_stepper import CompiledStepper
from codegen.toolchain.compiler import flags_at_level
from engine.interpreter.interpreter import Interpreter
from engine.simulation.simulate import simulate
from modewright.api.simulation import load
from tests.language.spec_builders import ROOT, program
from tests.lockstep.heater import heater

stepper = partial(CompiledStepper, flags=flags_at_level("O0"))
DRIVELINES = ROOT / "tests/data/specs/drivelines"


@pytest.mark.parametrize(
    ("name", "scenario", "horizon"),
    [("two_gaps", "tip_out_in", Fraction(6, 10)), ("clutch", "launch", Fraction(13, 10))],
)
def test_the_engine_gets_the_same_bits(name: str, scenario: str, horizon: Fraction) -> None:
    """Regions, and inputs that change inside the steps."""
    loaded = load(name, scenario, root=DRIVELINES)
    short = dataclasses.replace(loaded.scenario, horizon=horizon)
    mine, theirs = (simulate(loaded.system, short, build) for build in (stepper, Interpreter))
    assert mine.events == theirs.events
    assert mine.events
    assert mine.csv() == theirs.csv()


def test_the_transitions_of_all_micro_steps_of_a_tick_are_told() -> None:
    root = ROOT / "tests/semantics/rules/a_chart_may_be_regions_and_no_modes"
    loaded = load("rig", "run", root=root)
    runs = [simulate(loaded.system, loaded.scenario, build) for build in (stepper, Interpreter)]
    assert len(runs[0].events) == 6
    assert runs[0].events == runs[1].events


def test_what_leaves_its_range_is_told_once_asked() -> None:
    made = heater()
    for run in (stepper(made), Interpreter(made)):
        run.set("input.T", 1e9)
        run.run("step")
        assert run.pop_range_violations() == ("T",)
        assert run.pop_range_violations() == ()


@pytest.mark.parametrize("number", ["float64", "float32"])
def test_values_are_rounded_to_the_number_type(number: str) -> None:
    text = f"""language: 1
automaton: one
period: 1 ms
numbers: {number}
parameters: {{a: {{value: 0.1, tunable: true, range: [0, 1]}}}}
inputs: {{u: {{unit: "1", range: [-9, 9]}}}}
equations: {{gain: a * u}}
initial: only
modes: {{only: {{}}}}
outputs: [gain]
"""
    made = program(text)
    values = []
    for run in (stepper(made), Interpreter(made)):
        run.set("input.u", 0.7)
        run.run("step")
        names = ("equation.gain", "calibration.a", "input.u")
        values.append((run.make_reader(names)(), run.has("equation.gain"), run.has("equation.z")))
    assert values[0] == values[1]
