"""Rewind as blocks of a Program: each transition that goes back has its own."""

from __future__ import annotations

from pathlib import Path

import pytest

from engine.interpreter.interpreter import Interpreter
from language.ir.traversal import reachable_blocks
from language.programs.model_run import SATURATION_BLOCK
from tests.language.spec_builders import program, project_of

LANE = """\
language: 1
automaton: lane
states: {x: {unit: m, initial: 0 m}}
flow: {x: der(x) = 1 m/s}
modes: {only: {}}
outputs: [x]
"""
TWINS = """\
language: 1
automaton: twins
period: 1 ms
numbers: float64
model: lane
states: {x: {initial: 0 m, range: [-9, 9]}}
templates: {moved: {runs: {of: lane.only}}}
initial: a
modes:
  a:
    like: moved
    transitions: {b_c: {to: a_b, when: x > 1 m, rewind: {until: x > 0.5 m, within: 8 ms}}}
  a_b:
    like: moved
    transitions: {c: {to: a, when: x > 3 m, rewind: {until: x > 2.5 m, within: 2 ms}}}
outputs: [x]
"""
PUSHED = """\
language: 1
automaton: pushed
states:
  x: {unit: m, initial: 0 m, range: [-9, 9]}
  z: {unit: m, initial: 0 m, range: [-9, 9]}
flow: {x: der(x) = 1 m/s, z: der(z) = speed}
initial: up
modes:
  up: {equations: {speed: 4 m/s}}
  down: {equations: {speed: -4 m/s}}
outputs: [x, z]
"""
HELD = """\
language: 1
automaton: held
period: 1 s
numbers: float64
model: pushed
states: {x: {initial: 0 m, range: [-9, 9]}, z: {initial: 0 m, range: [-9, 5], on_range: ON_RANGE}}
initial: a
modes:
  a:
    runs: {of: pushed.up, follow: false, method: METHOD}
    transitions: {b: {when: x > 1.9 m, rewind: {until: x > 1.5 m, within: 2 s}}}
  b: {runs: {of: pushed.down, follow: false, method: METHOD}}
outputs: [x, z]
"""


def test_names_that_read_alike_when_joined_are_kept_apart(tmp_path: Path) -> None:
    project = project_of(tmp_path, lane=LANE)
    blocks = program(TWINS, project).blocks
    untils = [repr(block) for name, block in blocks.items() if name.startswith("until_")]
    assert sorted("Value(value=2.5)" in text for text in untils) == [False, True]


def test_the_rings_hold_what_the_longest_rewind_asks_for(tmp_path: Path) -> None:
    made = program(TWINS, project_of(tmp_path, lane=LANE))
    assert {v.size for v in made.variables if v.name == "memory.past_x"} == {8}
    assert [info.rewind_ticks for info in made.transitions] == [8, 2]


@pytest.mark.parametrize("method", ["euler", "exact", "midpoint", "rk4"])
@pytest.mark.parametrize(("on_range", "there"), [("saturate", 5.0), ("hold", 4.0)])
def test_what_leaves_its_range_at_a_crossing_is_held_there(
    tmp_path: Path, method: str, on_range: str, there: float
) -> None:
    """z is 4 at the tick before the crossing, 6 at it: the bound, or what it was (rule 18)."""
    text = HELD.replace("METHOD", method).replace("ON_RANGE", on_range)
    made = program(text, project_of(tmp_path, pushed=PUSHED))
    (back,) = [name for name in made.blocks if name.startswith("rollback_")]
    assert (SATURATION_BLOCK in reachable_blocks(back, made.blocks)) == (
        method in ("midpoint", "rk4")
    )
    inside = Interpreter(made)
    for _ in range(3):
        inside.run("step")
    assert inside.get("state.x") == pytest.approx(2.0)
    assert inside.get("state.z") == pytest.approx(there - 2.0, abs=1e-6)
