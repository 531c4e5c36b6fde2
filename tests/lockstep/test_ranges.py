"""Ranges: what a value outside its range becomes, as rule 18 says; engine and C alike."""

from __future__ import annotations

import math
import random
import struct
from pathlib import Path

import pytest

from engine.interpreter.interpreter import Interpreter
from language.ir.number_type import NUMBER_TYPES, NumberType, round_to_type
from lockstep.comparison import compare
from lockstep.tick_log import TickLog
from modewright.api.simulation import program
from tests.lockstep.heater import column
from tests.lockstep.program_strategies import Tick, record_ticks

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


CONVERSIONS = """\
language: 1
automaton: conversions
period: 1 ms
numbers: {numbers}
inputs: {{u: {{unit: 1, range: [-1.0e30, 1.0e30]}}}}
discrete:
  any: {{type: int, initial: 0, range: [-2147483647, 2147483647]}}
  up: {{type: int, initial: 0, range: [0, 2147483647]}}
  few: {{type: int, initial: 0, range: [-9, 9]}}
  kept: {{type: int, initial: 1, range: [-2147483647, 9], on_range: hold}}
modes:
  only: {{update: {{any: floor(u), up: floor(u), few: floor(u), kept: floor(u)}}}}
outputs: [any, up, few, kept, faults]
"""
LARGEST = 2**31 - 1


def convert(number: NumberType, folder: Path, reals: list[float]) -> TickLog:
    (folder / "conversions.yaml").write_text(CONVERSIONS.format(numbers=number))
    made = program(str(folder / "conversions.yaml"))
    # The faults stay set: each value has an instance of its own.
    return record_ticks(made, [{"input.u": u} for u in reals])


@pytest.mark.parametrize("number", NUMBER_TYPES)
@pytest.mark.parametrize(
    ("u", "value", "is_too_large"),
    [
        (2147483520.0, 2147483520, False),
        (-2147483520.0, -2147483520, False),
        (2147483600.7, 2147483600, False),
        (-2147483600.7, -2147483601, False),
        (2147483648.0, LARGEST, True),
        (-2147483648.0, -LARGEST, True),
        (3.0e9, LARGEST, True),
        (1.0e30, LARGEST, True),
        (-1.0e30, -LARGEST, True),
        (7.9, 7, False),
    ],
)
def test_a_real_too_large_for_an_int_saturates_with_a_fault_bit(
    number: NumberType, u: float, value: int, is_too_large: bool, tmp_path: Path
) -> None:
    if number == "float32" and not is_too_large and abs(u) > 2147483520.0:
        value, is_too_large = (LARGEST if u > 0.0 else -LARGEST), True  # rounded to 2^31
    tape = convert(number, tmp_path, [u])
    row = dict(zip(tape.names, tape.unpack(tape.values[-1]), strict=True))
    assert row["discrete.any"] == value
    assert row["discrete.up"] == max(value, 0)
    assert row["discrete.few"] == max(-9, min(value, 9))
    assert row["discrete.kept"] == (1 if value > 9 or is_too_large else value)
    faults = enumerate(tape.program.faults)
    found = {name for bit, name in faults if int(row["memory.faults"]) >> bit & 1}
    assert found == {
        *({"range_any"} if is_too_large else ()),
        *({"range_up"} if value < 0 or is_too_large else ()),
        *({"range_few"} if abs(value) > 9 else ()),
        *({"range_kept"} if value > 9 or is_too_large else ()),
    }


@pytest.mark.parametrize("number", NUMBER_TYPES)
def test_conversions_have_the_same_bits_in_c(number: NumberType, tmp_path: Path) -> None:
    draw = random.Random(f"conversions {number}")
    limits = [2.0**31, 2.0**31 - 1.0, 2.0**31 - 0.5, 2.0**31 - 128.0, 2.0**24, 0.5, 9.5, 1.0e30]
    near = [math.nextafter(x, y) for x in limits for y in (0.0, math.inf)]
    reals = [*limits, *near, *(2.0 ** draw.uniform(-3.0, 40.0) for _ in range(300))]
    tape = convert(number, tmp_path, [sign * x for x in reals for sign in (1.0, -1.0)])
    verdict = compare(tape)
    assert verdict.is_equal, str(verdict.first)


def test_the_limit_of_the_type_is_no_fault_where_no_real_is_converted(tmp_path: Path) -> None:
    text = CONVERSIONS.format(numbers="float64").replace("any: floor(u)", 'any: "max(any, up)"')
    text = text.replace("any: {type: int, initial: 0", "any: {type: int, initial: -2147483647")
    (tmp_path / "conversions.yaml").write_text(text)
    made = program(str(tmp_path / "conversions.yaml"))
    tape = record_ticks(made, [{"input.u": 3.0}, {"input.u": 4.0}])
    assert tape.unpack(tape.values[0])[tape.names.index("memory.faults")] == 0
