"""MC/DC of generated C: what sequences show is counted, what they do not is told with its place."""

from __future__ import annotations

import json
import shutil
import struct

import pytest
from typer.testing import CliRunner

from codegen.coverage.boundary_values import NEIGHBOUR_COUNT
from codegen.coverage.mcdc import COVERAGE_EXPORTER, McdcCoverage, measure_mcdc
from codegen.emit.c_module import emit_c_files
from language.ir.program import Program
from modewright.api import code_generation as code
from modewright.cli.app import app
from tests.language.spec_builders import program

pytestmark = pytest.mark.skipif(
    not shutil.which(COVERAGE_EXPORTER), reason="no llvm-cov-19: make system-packages"
)
LAMP = """language: 1
automaton: lamp
period: 10 ms
numbers: float64
inputs: {key: {type: bool}, dark: {type: bool}, door: {type: bool}}
initial: unlit
modes:
  unlit: {transitions: {lit: {when: key and (dark or door)}}}
  lit: {transitions: {unlit: {when: not key}}}
outputs: [mode]
"""
GUARD = "in->key && (in->dark || in->door)"


def lamp() -> Program:
    return program(LAMP)


def sequence(*ticks: tuple[int, int, int]) -> list[bytes]:
    return [struct.pack("<4d", *tick, 0.0) for tick in ticks]


def guard(found: McdcCoverage) -> tuple[bool, ...]:
    """Return what is shown of the guard of `unlit`."""
    (decision,) = (d for d in found.decisions if d.text == GUARD)
    text = emit_c_files(lamp())["lamp.c"].split("\n")
    assert GUARD in text[decision.line - 1]
    return decision.shown


@pytest.mark.parametrize(
    ("ticks", "shown"),
    [
        ([(0, 0, 0), (1, 1, 0)], (True, False, False)),
        ([(1, 0, 0), (1, 1, 0)], (False, True, False)),
        ([(1, 0, 0), (1, 0, 1)], (False, False, True)),
        ([(1, 0, 0), (0, 1, 0)], (False, False, False)),
        ([(0, 1, 0), (1, 0, 0), (1, 1, 0), (0, 0, 0), (1, 0, 1)], (True, True, True)),
    ],
)
def test_a_condition_is_shown_where_it_alone_decides(
    ticks: list[tuple[int, int, int]], shown: tuple[bool, ...]
) -> None:
    assert guard(measure_mcdc(lamp(), [sequence(*ticks)])) == shown


def test_sequences_add_up_and_each_begins_anew() -> None:
    halves = [sequence((1, 0, 0), (1, 1, 0)), sequence((0, 0, 0), (1, 0, 1))]
    found = measure_mcdc(lamp(), halves)
    assert guard(found) == (True, True, True)
    assert (found.sequences, found.steps) == (2, 4)
    assert guard(measure_mcdc(lamp(), halves[:1])) == (False, True, False)


def test_a_decision_of_one_condition_has_to_be_true_and_false() -> None:
    once = {d.text: d.shown for d in measure_mcdc(lamp(), [sequence((1, 1, 0))]).decisions}
    both = {
        d.text: d.shown for d in measure_mcdc(lamp(), [sequence((1, 1, 0), (0, 0, 0))]).decisions
    }
    (text,) = (text for text in both if text in ("!in->key", "in->key"))
    assert text not in once or once[text] == (False,)
    assert not any(text.startswith("case ") for text in both)


@pytest.mark.long
def test_the_command_tells_what_was_not_shown() -> None:
    text = CliRunner().invoke(app, ["mcdc", "contactor", "--runs", "60"]).output
    first, last = text.split("\n")[0], text.strip().split("\n")[-1]
    assert last.startswith("contactor.c: ") and "are shown to matter (MC/DC)" in last
    assert first.startswith("contactor.c:")
    made = CliRunner().invoke(app, ["mcdc", "contactor", "--runs", "60", "--json"]).output
    found = json.loads(made)
    assert found["conditions"] == sum(len(d["shown"]) for d in found["decisions"]) > found["shown"]


@pytest.mark.long
def test_tests_of_the_project_are_the_sequences() -> None:
    found = code.mcdc("estimator", is_proven=False)
    assert (
        found.sequences > 3 and (found.sequences - 3) % (2 * NEIGHBOUR_COUNT) == 0
    )  # and their borders
    assert 0 < found.shown == found.conditions - found.open < found.conditions
    (stamp,) = (d for d in found.decisions if "stamp_J_em" in d.text)
    assert stamp.shown == (False,)  # tests have the page of the spec


@pytest.mark.long
def test_nothing_to_run_it_on_is_told() -> None:
    with pytest.raises(ValueError, match="no test of the project runs contactor as it is: give it"):
        code.mcdc("contactor")
    with pytest.raises(ValueError, match="is continuous"):
        code.mcdc("driveline", 10)
