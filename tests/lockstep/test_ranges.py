"""Ranges: what a value outside its range becomes, as rule 18 says; engine and C alike."""

from __future__ import annotations

import math
import struct

import pytest

from engine.interpreter.interpreter import Interpreter
from language.ir.number_type import NumberType, round_to_type
from lockstep.comparison import compare
from lockstep.tick_log import TickLog
from modewright.api.simulation import program
from tests.lockstep.heater import column
from tests.lockstep.program_strategies import Tick

LOW, HIGH = -1.5, 2.25
BOUNDS = {name: (LOW, HIGH) for name in "abcdef"} | {"m": (-HIGH, HIGH)}
"""Of each real input; those of `m` are one comparison in C."""
SPEC = """\
language: 1
automaton: ranges
period: 1 ms
numbers: {numbers}
faults: {{loose: {{latched: false}}}}
fault_mode: safe
inputs:
  a: {{unit: m, range: [-1.5, 2.25]}}
  b: {{unit: m, range: [-1.5, 2.25], fallback: 0.5 m}}
  c: {{unit: m, range: [-1.5, 2.25], fallback: hold, fault: loose}}
  d: {{unit: m, range: [-1.5, 2.25], on_range: hold}}
  e: {{unit: m, range: [-1.5, 2.25], on_range: hold, fallback: 0.5 m, fault: loose}}
  f: {{unit: m, range: [-1.5, 2.25], on_range: fault, default: 1 m}}
  m: {{unit: m, range: [-2.25, 2.25]}}
  k: {{type: int, range: [-3, 5]}}
  g: {{type: enum, values: [low, high], fallback: high}}
states:
  x: {{unit: m, initial: a, range: [-4, 4]}}
  z: {{unit: m, initial: b, range: [-4, 4], on_range: hold}}
discrete:
  i: {{type: int, initial: 0, range: [-7, 7]}}
  j: {{type: int, initial: 0, range: [-7, 7], on_range: hold}}
  w: {{unit: m, initial: 0 m, range: [-4, 4], fallback: 3 m}}
  r: {{type: enum, values: [low, high], initial: low}}
equations:
  sa: a
  sb: b
  sc: c
  sd: d
  se: e
  sf: f
  sm: m
  sk: k
  sg: g
initial: drive
modes:
  drive:
    exit: {{j: j + 100}}
    update:
      x: x + a
      z: z + b
      i: floor(a * 1.0e9 / 1 m)
      w: w + (if g == high then x * 1.0e300 else c)
  safe:
    entry: {{r: high, j: j + 1}}
    transitions: {{drive: {{when: a > 0 m, reset: {{x: x * 3, r: low}}}}}}
outputs: [mode, faults]
"""
VALUES = [0.0, -0.0, 5e-324, -5e-324, 1e-40, LOW, HIGH, math.nextafter(LOW, -9), -2.0]
VALUES += [math.nextafter(HIGH, 9), 1e9, math.inf, -math.inf, math.nan, 1.0, 2.0, -1.0]
VALUES += [-HIGH, math.nextafter(-HIGH, -9)]
FALLBACK = 0.5


def bits(value: float) -> bytes:
    return struct.pack("<d", value)


def nearest(name: str, value: float) -> float:
    """Return the nearest bound; the lower one for NaN (rule C7)."""
    low, high = BOUNDS[name]
    return high if value > high else low


def held(name: str, value: float, last: float) -> float:
    """Return what rule 18 makes of an input's value, given what it held before."""
    low, high = BOUNDS[name]
    if low <= value <= high:
        return value
    if not math.isfinite(value) and name in "be":
        return FALLBACK
    if name in "def" or (not math.isfinite(value) and name == "c"):
        return last
    return nearest(name, value)


def ticks() -> list[Tick]:
    """Return ticks in which each input takes each value, beside different ones of the others.

    Then those in which all take the same, inside: C takes these at once.
    """
    found: list[Tick] = []
    for k in range(3 * len(VALUES)):
        tick: Tick = {
            f"input.{name}": VALUES[(k * (2 * place + 1) + place) % len(VALUES)]
            for place, name in enumerate(BOUNDS)
        }
        tick["input.k"], tick["input.g"] = (
            (-4, -3, 0, 5, 6, 100000)[k % 6],
            (0, 1, 2, 255)[k % 4],
        )
        found.append(tick)
    for value in (value for value in VALUES if LOW <= value <= HIGH):
        found.append({f"input.{name}": value for name in BOUNDS} | {"input.k": 5, "input.g": 1})
    return found


@pytest.fixture(scope="module", params=["float64", "float32"])
def tape(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> TickLog:
    path = tmp_path_factory.mktemp("ranges") / "ranges.yaml"
    numbers: NumberType = request.param
    spec = SPEC if numbers == "float64" else SPEC.replace("1.0e300", "1.0e38")
    path.write_text(spec.format(numbers=numbers))
    made = program(str(path))
    stepper, tape = Interpreter(made), TickLog(made, "ranges")
    for tick in ticks():
        for name, value in tick.items():
            stepper.set(name, value)
        stepper.run("step")
        tape.record_tick(stepper)
    return tape


def test_engine_and_c_do_the_same(tape: TickLog) -> None:
    verdict = compare(tape)
    assert verdict.ticks == len(ticks())
    assert verdict.transitions > 4
    assert verdict.is_equal, str(verdict.first)


@pytest.mark.parametrize("name", list(BOUNDS))
def test_an_input_is_what_rule_18_says(tape: TickLog, name: str) -> None:
    number = tape.program.number_type
    last = 1.0 if name == "f" else 0.0
    for tick, found in zip(ticks(), column(tape, f"latched.{name}"), strict=True):
        given = round_to_type(float(tick[f"input.{name}"]), number)
        last = held(name, given, last)
        assert bits(found) == bits(last), (given, found, last)


def test_a_whole_number_takes_the_nearest_bound_and_a_name_its_fallback(tape: TickLog) -> None:
    wanted = [min(max(int(tick["input.k"]), -3), 5) for tick in ticks()]
    assert column(tape, "latched.k") == wanted
    names = [int(tick["input.g"]) for tick in ticks()]
    assert column(tape, "latched.g") == [name if name in (0, 1) else 1 for name in names]


def test_the_bit_is_set_in_the_same_tick_and_cleared_where_it_is_not_latched(tape: TickLog) -> None:
    bit = {fault: 1 << place for place, fault in enumerate(tape.program.faults)}
    words = [int(word) for word in column(tape, "memory.faults")]
    number, latched = tape.program.number_type, False
    for tick, word in zip(ticks(), words, strict=True):
        inside = {
            n: LOW <= round_to_type(float(tick[f"input.{n}"]), number) <= HIGH for n in "abcdef"
        }
        assert bool(word & bit["loose"]) == (not (inside["c"] and inside["e"]))
        latched = latched or not inside["a"]
        assert bool(word & bit["range_a"]) == latched


def test_no_state_leaves_its_range_and_nothing_is_not_finite(tape: TickLog) -> None:
    for name, limit in (("state.x", 4), ("state.z", 4), ("discrete.w", 4), ("discrete.i", 7)):
        assert all(-limit <= value <= limit for value in column(tape, name)), name
    assert {0, 1} == set(column(tape, "discrete.r"))


def test_the_floor_of_a_real_is_held_in_the_range_of_its_target(tape: TickLog) -> None:
    active = tape.program.modes[0].number
    for mode, a, i in zip(
        column(tape, "memory.mode"),
        column(tape, "latched.a"),
        column(tape, "discrete.i"),
        strict=True,
    ):
        if mode == active and abs(a) > 1e-7:
            assert i == (7 if a > 0 else -7)
