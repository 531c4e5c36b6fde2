"""ha_math: every function has the same bits in C and in the interpreter, at special points too."""

from __future__ import annotations

import math
import random
import shutil
import subprocess
from pathlib import Path

import pytest

from codegen.emit.c_expression import MATH_SUFFIX
from codegen.emit.c_module import emit_c_files
from codegen.toolchain.compiler import FLAGS, WARNINGS, find_compiler
from language.ir.number_type import NUMBER_TYPES, NumberType
from language.numerics.evaluate import ELEMENTARY, Scalar, apply_function
from language.numerics.function_table import FUNCTIONS
from lockstep.comparison import compare
from lockstep.tick_log import TickLog
from modewright.api.simulation import program
from tests.lockstep.program_strategies import Tick, record_ticks

POINTS = 20_000
SPEC = """\
language: 1
automaton: functions
period: 1 ms
numbers: float64
parameters:
  curve: {tunable: true, table: {over: u, points: {-3: 2, -0.5: 7.1, 0: -1, 0.25: 0.1, 100: 5}}}
  plane:
    table:
      over: [u, v]
      points: {-1: {-2: 1, 0: 0.3}, 0: {-2: 4, 0: -7}, 1.5: {-2: 0.1, 0: 0.2}}
  bent: {tunable: true, table: {over: u, points: {-1: 3, 0: -0.0, 2: 0.7}}}
  sheet:
    tunable: true
    table:
      over: [u, v]
      points:
        {-1: {-2: 1, 0: 0.3, 1: 2}, 0: {-2: 4, 0: -7, 1: 9}, 1.5: {-2: 0.1, 0: 0.2, 1: -0.7}}
inputs: {u: {unit: "1"}, v: {unit: "1"}, w: {unit: "1"}}
equations:
  s: sin(u * 1 rad)
  c: cos(u * 1 rad)
  e: exp(u)
  t: tanh(u)
  log_u: log(u)
  size: abs(u)
  root: sqrt(u)
  least: min(u, v)
  most: max(u, v)
  limited: clip(u, v, w)
  direction: sign(u)
  whole: floor(u)
  slope: tan(u * 1 rad)
  heading: atan2(u, v)
  raised: pow(u, v)
  along: lookup(curve, u)
  over: lookup(plane, u, v)
  bend: lookup(bent, u)
  height: lookup(sheet, u, v)
modes: {only: {}}
outputs:
  [s, c, e, t, log_u, size, root, least, most, limited, direction, whole, slope, heading,
    raised, along, over, bend, height]
"""
SIGNALS = {"sin": "s", "cos": "c", "exp": "e", "tanh": "t", "abs": "size", "sqrt": "root"}
SIGNALS |= {"floor": "whole", "tan": "slope", "log": "log_u"}


def specials() -> list[float]:
    """Return arguments with a story: limits, ties, tiny and huge numbers, and their neighbours."""
    found = [0.0, 5e-324, 1e-310, 2.0**-1022, 2.0**-54, 2.0**-27, 0.625, 19.07, 20.0, 1e5]
    found += [708.0, 709.0, 2.0**52, 2.0**53, 1e16, 1e300, 1.7976931348623157e308, math.inf]
    found += [n * (math.pi / 4) for n in (*range(1, 17), 1000, 63_661, 127_323)]
    found += [(n + 0.5) * math.log(2.0) for n in (-1021, -1, 0, 1, 700, 1022)]
    near = [math.nextafter(x, y) for x in found for y in (-math.inf, math.inf)]
    return [*(sign * x for x in (*found, *near) for sign in (1.0, -1.0)), math.nan]


def arguments() -> list[float]:
    draw = random.Random("ha_math")
    found = specials()
    while len(found) < POINTS:
        choice = len(found) % 4
        size = 2.0 ** draw.uniform(-1074.0, 1023.0) if choice else draw.uniform(0.0, 1e5)
        wide = draw.uniform(-800.0, 800.0) if choice < 3 else draw.uniform(-25.0, 25.0)
        found.append(draw.choice((size, -size)) if choice < 2 else wide)
    return found


@pytest.fixture(scope="module")
def tape(tmp_path_factory: pytest.TempPathFactory) -> TickLog:
    """The interpreter at all points; `v` and `w` are other points, special ones among them."""
    path = tmp_path_factory.mktemp("functions") / "functions.yaml"
    path.write_text(SPEC)
    points = arguments()
    others = random.Random("others").sample(points, len(points))
    inputs: list[Tick] = [
        {"input.u": u, "input.v": v, "input.w": w}
        for u, v, w in zip(points, others, reversed(others), strict=True)
    ]
    return record_ticks(program(str(path)), inputs)


def test_every_function_has_the_same_bits_in_c(tape: TickLog) -> None:
    """A warning of the compiler is an error here: tunable tables keep their qualifiers."""
    verdict = compare(tape, (*FLAGS, "-Werror"))
    assert verdict.ticks == POINTS
    assert verdict.is_equal, str(verdict.first)


@pytest.mark.parametrize("function", SIGNALS)
def test_the_interpreter_has_the_bits_of_check_time(tape: TickLog, function: str) -> None:
    """Parameters are derived by language/numerics/evaluate.py, equations by the interpreter."""
    position = tape.names.index(f"equation.{SIGNALS[function]}")
    for u, record in zip(arguments()[:2000], tape.values, strict=False):
        expected: Scalar = apply_function(function, [u])
        assert same(float(tape.unpack(record)[position]), float(expected)), u


def same(a: float, b: float) -> bool:
    return (a != a and b != b) or (a == b and math.copysign(1.0, a) == math.copysign(1.0, b))


def test_no_function_of_the_language_is_left_out() -> None:
    """`pow2`, `real` and `whole` are not written in specs: other lock-steps compare them."""
    called = {name for name in (*FUNCTIONS, *ELEMENTARY) if f"{name}(" in SPEC}
    assert called == {*FUNCTIONS, *ELEMENTARY} - {"pow2", "real", "whole", "lookup2"}


@pytest.mark.parametrize("number", NUMBER_TYPES)
def test_tunable_tables_compile_without_warnings(number: NumberType, tmp_path: Path) -> None:
    """The header of their lookups is written only for a module that reads such a table."""
    spec = tmp_path / "functions.yaml"
    spec.write_text(SPEC.replace("float64", number))
    files = emit_c_files(program(str(spec)))
    header = f"ha_page{MATH_SUFFIX[number]}.h"
    assert f'#include "{header}"' in files["functions.c"]
    assert "lookup(axis_curve_1, 5, cal->curve," in files["functions.c"].replace(
        "lookupf", "lookup"
    )
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    command = [*find_compiler(), *FLAGS, *WARNINGS, "-Werror", "-c", "functions.c"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    spec.write_text(SPEC.replace("float64", number).replace("tunable: true", "range: [-9, 9]"))
    assert header not in emit_c_files(program(str(spec)))


ALL_TABLES = """\
language: 1
automaton: tables
period: 10 ms
numbers: {numbers}
parameters:
  one: {{table: {{over: u, unit: N*m, points: {{0: 5, 1: 6, 4: 7}}}}, tunable: true}}
  two:
    table: {{over: [u, v], unit: 1, points: {{0: {{0: 1, 1: 2}}, 1: {{0: 3, 1: 4}}}}}}
    tunable: true
  fixed: {{table: {{over: u, unit: 1, points: {{0: 5, 1: 6}}}}}}
  gain: {{value: 2, range: [0, 5], tunable: true}}
inputs: {{u: {{unit: 1, range: [0, 9]}}, v: {{unit: 1, range: [0, 9]}}}}
states: {{x: {{unit: 1, initial: "lookup(two, 0.5, 0.5)", range: [-99, 99]}}}}
equations: {{a: "lookup(one, u * gain)", b: "lookup(two, u, v)", c: "lookup(fixed, u)"}}
initial: low
modes:
  low: {{update: {{x: x + b}}, transitions: {{high: {{when: "lookup(two, v, u) > 2"}}}}}}
  high: {{transitions: {{low: {{when: x > 9, reset: {{x: "lookup(fixed, v)"}}}}}}}}
outputs: [a, b, c, x, mode]
"""


@pytest.mark.parametrize("number", NUMBER_TYPES)
@pytest.mark.parametrize(
    "command",
    [
        ("gcc", "-std=c99", "-pedantic-errors", *WARNINGS, "-Werror"),
        ("clang-19", "-std=c99", "-pedantic-errors", *WARNINGS, "-Werror"),
        ("g++", "-x", "c++", "-Wall"),
    ],
    ids=lambda command: command[0],
)
def test_tables_of_every_kind_are_valid_for_every_compiler(
    command: tuple[str, ...], number: NumberType, tmp_path: Path
) -> None:
    """A C++ compiler refuses a lost `volatile` and a constant without a value."""
    if shutil.which(command[0]) is None:
        pytest.skip(f"{command[0]} is not installed: make system-packages")
    spec = tmp_path / "tables.yaml"
    spec.write_text(ALL_TABLES.format(numbers=number))
    files = emit_c_files(program(str(spec)))
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    for name in (name for name in files if name.endswith(".c")):
        line = [*command, "-c", name, "-o", "made.o"]
        done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert "warning" not in done.stderr
