"""Long times: counters of more than 16 bits have the same values in engine and C."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

import modewright as mw
from codegen.emit.c_module import emit_c_files
from codegen.emit.c_names import c_type
from codegen.exchange.a2l.description import describe_module
from codegen.toolchain.compiler import FLAGS, WARNINGS
from language.ir.program import Program
from tests.language.spec_builders import program, project_of

SLOW = """language: 1
automaton: slow
period: 1 ms
numbers: float32
inputs: {u: {unit: "1", range: [0, 10]}}
parameters:
  t_w: {value: 65.536 s, range: [0 s, 12 h], tunable: true}
  t_short: {value: 1 s, range: [0 s, 65 s], tunable: true}
  t_any: {value: 1 s, tunable: true}
initial: fixed
modes: {fixed: {transitions: {rest: {when: u > 5, wait: 65.536 s}}}, rest: {}}
regions:
  tuned:
    initial: first
    modes:
      first: {transitions: {second: {when: u > 5, wait: t_w}}}
      second:
        transitions:
          first: {when: u < 5, wait: t_short}
          third: {when: u < 4, wait: t_any, priority: 1}
      third: {}
  timed:
    initial: early
    modes: {early: {transitions: {late: {when: after(65.537 s)}}}, late: {}}
  beats:
    initial: idle
    modes:
      idle:
        transitions:
          beat: {to: idle, when: every(65.538 s)}
          tick: {to: idle, when: u < 1, wait: 65 s, priority: 1}
outputs: [mode]
"""
"""Times of 65 536 ticks and more; 65 535 is the largest number of 16 bits."""
SCENARIO = "language: 1\nscenario: run\nof: slow\nhorizon: 65.6 s\ninputs: {u: 6}\n"


@pytest.fixture(scope="module")
def slow() -> Program:
    return program(SLOW)


def test_long_times_are_counted_in_lockstep(tmp_path: Path) -> None:
    project_of(tmp_path, slow=SLOW, run=SCENARIO + "record: {every: 1 s}\n")
    found, verdicts = mw.lockstep("slow", "run", root=tmp_path)
    assert all(verdict.is_equal for verdict in verdicts)
    assert {(event.target, round(event.time, 9)) for event in found.events} == {
        ("rest", 65.536),
        ("second", 65.536),
        ("late", 65.537),
        ("idle", 65.538),
    }


def test_a_counter_is_as_wide_as_it_counts(slow: Program) -> None:
    kinds = {v.name: c_type(v, "float32") for v in slow.variables if v.name.startswith("timer.")}
    assert kinds == {
        "timer.fixed_rest": "uint32_t",
        "timer.tuned_first_second": "uint32_t",
        "timer.tuned_second_first": "uint16_t",
        "timer.tuned_second_third": "uint32_t",
        "timer.after_1": "uint32_t",
        "timer.every_1": "uint32_t",
        "timer.beats_idle_tick": "uint16_t",
    }


def test_a_tunable_wait_has_the_type_of_its_counter_and_its_exact_range(slow: Program) -> None:
    """A float32 does not have the number 2^31 - 1."""
    page = {one.path: one for one in describe_module(slow).characteristics}
    found = {name: (page[name].type, page[name].limits) for name in ("t_w", "t_short", "t_any")}
    assert found == {
        "t_w": ("uint32_t", (0, 43_200_000)),
        "t_short": ("uint16_t", (0, 65_000)),
        "t_any": ("uint32_t", (0, 2**31 - 2)),
    }


def test_long_times_compile_without_a_warning(slow: Program, tmp_path: Path) -> None:
    for name, text in emit_c_files(slow).items():
        (tmp_path / name).write_text(text)
    command = ["gcc", *FLAGS, *WARNINGS, "-Werror", "-c", "slow.c", "-o", "slow.o"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
