"""Short times: a time of zero, and times so close that their difference squared is zero."""

from __future__ import annotations

import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import modewright as mw
from engine.simulation.sensors import FirstOrderLag
from tests.language.spec_builders import problem_lines, program, project_of

LAUNCH = """language: 1
automaton: launch
step: 10 ms
numbers: float64
parameters: {t_d: {value: 0 s}}
states: {x: {unit: m, initial: 0 m}}
flow: {x: der(x) = 1 m/s}
initial: idle
modes: {idle: {transitions: {away: {when: after(t_d)}}}, away: {}}
regions:
  side: {initial: near, modes: {near: {transitions: {far: {when: falling(x < 0.05 m)}}}, far: {}}}
outputs: [x, mode]
"""
"""An edge in one region is located in the steps that end with a time of the other region."""
NO_TIMES = {
    "float64": ("0 s", "1.0e-30 s", "1.0e-200 s", "1.0e-320 s"),
    "float32": ("0 s", "1.0e-18 s", "1.0e-30 s", "1.0e-44 s"),
}
SCENARIO = "language: 1\nscenario: run\nof: {of}\nhorizon: 0.1 s\n"
MIXED = """language: 1
automaton: mixed
step: 10 ms
inputs: {u: {unit: 1/s}, w: {unit: "1"}}
states: {x: {initial: 0}}
flow: {x: der(x) = u}
initial: below
modes: {below: {transitions: {above: {when: x > 0.055}}}, above: {}}
regions:
  side: {initial: dark, modes: {dark: {transitions: {lit: {when: rising(w > 0.5)}}}, lit: {}}}
outputs: [x, mode]
"""


def transition_times(folder: Path, text: str, of: str, rest: str = "") -> list[tuple[str, float]]:
    """Return target and time of the transitions of a run whose states are all finite."""
    project_of(folder, model=text, run=SCENARIO.format(of=of) + rest)
    found = mw.simulate(of, "run", root=folder)
    assert found.stopped is None
    assert np.isfinite(found.signals[f"{of}.x"]).all()
    return [(event.target, event.time) for event in found.events]


@pytest.mark.parametrize(
    ("numbers", "time"), [(numbers, time) for numbers in NO_TIMES for time in NO_TIMES[numbers]]
)
@pytest.mark.parametrize("form", ["after(t_d)", "x >= 0 m, wait: t_d"])
def test_a_time_of_zero_ends_at_the_entry(
    form: str, time: str, numbers: str, tmp_path: Path
) -> None:
    text = LAUNCH.replace("value: 0 s", f"value: {time}").replace("after(t_d)", form)
    events = transition_times(tmp_path, text.replace("float64", numbers), "launch")
    assert events == [("away", 0.0), ("far", pytest.approx(0.05, rel=1e-6))]


def test_an_after_of_zero_has_no_timer() -> None:
    assert "timer.after_1" not in _variable_names(LAUNCH)
    assert "timer.after_1" in _variable_names(LAUNCH.replace("value: 0 s", "value: 1 ms"))


def _variable_names(text: str) -> list[str]:
    return [variable.name for variable in program(text).variables]


def test_modes_that_follow_each_other_in_no_time_are_left_at_one_instant(tmp_path: Path) -> None:
    chain = "idle: {transitions: {next: {when: after(0 s)}}}, next: "
    text = LAUNCH.replace("idle: ", chain, 1)
    events = transition_times(tmp_path, text, "launch")
    assert events[:2] == [("next", 0.0), ("away", 0.0)]


@pytest.mark.parametrize("numbers", ["float64", "float32"])
def test_an_every_that_can_only_stop_a_run_is_refused(numbers: str) -> None:
    text = LAUNCH.replace("after(t_d)", "every(t_d)").replace("float64", numbers)
    (line,) = problem_lines(lambda: program(text.replace("value: 0 s", "value: 1.0e-30 s")))
    assert line.endswith("`every` of 1e-30 s has more than 100 instants in a major step")


@pytest.mark.parametrize("time", ["0.0551", "0.05"])
@pytest.mark.parametrize("gap", ["1" + 19 * "0", "1" + 199 * "0", "1" + 340 * "0"])
def test_times_of_a_scenario_may_be_as_close_as_is_written(
    gap: str, time: str, tmp_path: Path
) -> None:
    """The inputs vary over a flow that is shorter than any number whose square is not zero."""
    late = str(Fraction(time) + Fraction(1, int(gap)))
    exact = _decimal(Fraction(late), len(gap) + 6)
    rest = "inputs: {u: {start: 1 1/s, ramp: {from: 0.02 s, to: 0.08 s, value: 2 1/s}}, "
    rest += f"w: {{start: 0, steps: {{{time} s: 1, {exact} s: 0}}}}}}\nrecord: {{every: 1 ms}}\n"
    events = transition_times(tmp_path, MIXED, "mixed", rest)
    above = pytest.approx(0.02 + 0.06 * (math.sqrt(13 / 6) - 1))
    assert sorted(events) == [("above", above), ("lit", float(time))]


def _decimal(number: Fraction, digits: int) -> str:
    """Return a number between 0 and 1 with some decimals."""
    return "0." + str(int(number * 10**digits)).rjust(digits, "0")


@pytest.mark.parametrize("short", [Fraction(1, 10**310), Fraction(1, 10**400)])
def test_a_lag_keeps_its_output_over_a_time_too_short_to_divide_by(short: Fraction) -> None:
    lag = FirstOrderLag(Fraction(1, 10))
    lag.advance(Fraction(0), 1.0)
    lag.advance(Fraction(0), 2.0)
    lag.advance(short, 2.0)
    assert lag.evaluate(short, 2.0) == 1.0
    assert 1.0 < lag.evaluate(Fraction(1, 10), 2.0) < 2.0
