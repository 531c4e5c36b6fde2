"""Rewind as blocks of a Program: each transition that goes back has its own."""

from __future__ import annotations

from pathlib import Path

from tests.language.making import program, project_of

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


def test_names_that_read_alike_when_joined_are_kept_apart(tmp_path: Path) -> None:
    project = project_of(tmp_path, lane=LANE)
    blocks = program(TWINS, project).blocks
    untils = [repr(block) for name, block in blocks.items() if name.startswith("until_")]
    assert sorted("Value(value=2.5)" in text for text in untils) == [False, True]


def test_the_rings_hold_what_the_longest_rewind_asks_for(tmp_path: Path) -> None:
    made = program(TWINS, project_of(tmp_path, lane=LANE))
    assert {v.size for v in made.variables if v.name == "memory.past_x"} == {8}
    assert [info.rewind for info in made.transitions] == [8, 2]
