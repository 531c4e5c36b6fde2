"""Automata with a tunable parameter of each kind, and with solved numbers, in both types."""

from __future__ import annotations

import struct
from functools import partial
from pathlib import Path

from language.ir.number_type import NumberType
from language.ir.program import Constant
from modewright.api.calibrations import CalibrationPage
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code

KINDS = """language: 1
automaton: kinds_{number}
period: 10 ms
numbers: {number}
parameters:
  gain:  {{value: 0.7, tunable: true, range: [0, 9], about: "of the \\"line\\"; 50 °C"}}
  speed: {{value: 900 rpm, tunable: true, range: [0, 12000]}}
  hot:   {{value: 90 degC, tunable: true, range: [-40, 150]}}
  share: {{value: 40 percent, tunable: true}}
  whole: {{value: 3, type: int, tunable: true, range: [-9, 900]}}
  flag:  {{value: true, type: bool, tunable: true}}
  hold:  {{value: 30 ms, tunable: true, range: [0, 2000]}}
  gear:  {{value: drive, type: enum, values: [park, drive, back], tunable: true}}
  line:
    tunable: true
    table: {{over: u, unit: N*m, points: {{0 degC: 10, 40 degC: 12.5, 90 degC: 1}}}}
  area:
    tunable: true
    table:
      over: [u, v]
      points: {{0 degC: {{0: 1, 1: 2, 2: 3}}, 90 degC: {{0: 4, 1: 8, 2: 0.1}}}}
inputs:
  u: {{unit: K, range: [200, 400]}}
  v: {{range: [0, 2]}}
  w: {{unit: rad/s, range: [0, 9000]}}
equations:
  y_line: lookup(line, u)
  y_area: lookup(area, u, v)
  y_rest: gain + whole + share
  is_fast: w > speed or u > hot
initial: waiting
modes:
  waiting: {{transitions: {{driven: {{when: flag and gear == drive, wait: hold}}}}}}
  driven: {{}}
outputs: [mode, y_line, y_area, y_rest, is_fast]
"""
SOLVED = """language: 1
variant: solved_{number}
extends: estimator_simple
numbers: {number}
parameters:
  J_em:  {{range: [0.01, 0.2]}}
  k_hs:  {{tunable: true, range: [4000, 6000]}}
  c_hs:  {{tunable: true, range: [10, 20]}}
  sd_em: {{value: 3 rpm, tunable: true}}
"""


def write_project(folder: Path) -> Path:
    """Write the specs of a project into a folder and return it."""
    spec = folder / "spec"
    spec.mkdir(exist_ok=True)
    for number in ("float64", "float32"):
        (spec / f"kinds_{number}.yaml").write_text(KINDS.format(number=number), "utf-8")
        (spec / f"solved_{number}.yaml").write_text(SOLVED.format(number=number))
    return folder


def constant_bits(page: CalibrationPage) -> dict[str, bytes]:
    """Return all constants of a page's Program with the bits of their values."""
    return {constant.name: _bits(constant) for constant in page.program.constants}


def _bits(constant: Constant) -> bytes:
    return struct.pack(f"<{1 + len(constant.items)}d", constant.value, *constant.items)


def run_command(*words: object) -> int:
    """Run a command of the command line and return its exit code."""
    command = ["calibration", *map(str, words)]
    return run_with_exit_code(partial(app, command, standalone_mode=False))


def replace_line(text: str, name: str, old: str, new: str) -> str:
    """Return a DCM file with a line of one characteristic replaced."""
    head, mark, tail = text.partition(f" {name}\n")
    assert mark and old in tail.partition("END")[0]
    return head + mark + tail.replace(old, new, 1)


NUMBERS: tuple[NumberType, ...] = ("float64", "float32")
