"""Exploring: ways through generated C, with waits of many ticks and with other pages."""

from __future__ import annotations

import shutil
from random import Random

import pytest

from codegen.coverage import coverage_exploration as exploring
from codegen.coverage.coverage_exploration import generate_corpus, page_scalars
from codegen.coverage.libfuzzer import FUZZER_COMPILER
from codegen.coverage.mcdc import COVERAGE_EXPORTER, measure_mcdc
from language.ir.program import Program
from modewright.api.simulation import program as program_named
from tests.language.spec_builders import program

pytestmark = pytest.mark.skipif(
    not (shutil.which(COVERAGE_EXPORTER) and shutil.which(FUZZER_COMPILER)),
    reason="no clang-19: make system-packages",
)
SLOW = """language: 1
automaton: slow
period: 10 ms
numbers: float32
parameters: {least: {value: 5, tunable: true, range: [0, 7]}}
inputs: {u: {unit: "1", range: [0, 6]}}
initial: unlit
modes:
  unlit: {transitions: {lit: {when: u > 1, wait: 4 s}}}
  lit: {transitions: {unlit: {when: least > 6 or u < 1}}}
outputs: [mode]
"""
RANGES = {"u": (0.0, 6.0)}


def slow() -> Program:
    return program(SLOW)


def test_a_page_is_its_single_numbers_with_their_ranges() -> None:
    assert page_scalars(slow()) == [{"member": "least", "type": "float", "low": 0.0, "high": 7.0}]


def test_solved_numbers_of_a_page_may_be_any() -> None:
    solved = {one["member"]: one for one in page_scalars(program_named("estimator_float32"))}
    assert solved["J_em"]["high"] == pytest.approx(0.2)
    assert solved["solved.stamp_J_em"]["high"] == 1e30
    assert solved["solved.drive_L_w_w__y_w"]["type"] == "float"


@pytest.mark.long
def test_a_wait_of_many_ticks_and_another_page_are_found() -> None:
    """`least > 6` is false with the page of the spec, and true with one where it is 7."""
    ways = generate_corpus(slow(), RANGES, 20_000, (1,))
    found = measure_mcdc(slow(), [], ways, RANGES)
    assert found.sequences == len(ways) and found.steps > 400
    shown = {decision.text: decision.shown for decision in found.decisions}
    assert shown["self->timer.unlit_lit > 400U"] == (True,)
    assert shown["(cal->least > 6.0F) || (self->latched.u < 1.0F)"] == (True, True)
    assert found.uncovered == measure_mcdc(slow(), [], ways[::-1], RANGES).uncovered


@pytest.mark.long
def test_seeds_find_the_same_ways_each_time() -> None:
    """The second one begins with what the first one found, in one order."""
    ways = generate_corpus(slow(), RANGES, 5_000, (1, 2))
    assert ways == generate_corpus(slow(), RANGES, 5_000, (1, 2))
    assert set(ways) > set(generate_corpus(slow(), RANGES, 5_000, (1,)))


@pytest.mark.long
def test_the_ways_of_a_large_program_are_short(monkeypatch: pytest.MonkeyPatch) -> None:
    """So many ticks are gone in C, and as many are looked at for borders."""
    assert exploring.max_entry_ticks(program_named("hko")) == exploring.MAX_LARGE_TICKS
    assert exploring.max_entry_ticks(slow()) > exploring.MAX_LARGE_TICKS
    draw = Random(1)
    ways = [draw.randbytes(size) for size in (40, 120, 200)]
    for most in (None, 50):
        if most:
            monkeypatch.setattr(exploring, "LARGE_PROGRAM", 0)
            monkeypatch.setattr(exploring, "MAX_LARGE_TICKS", most)
        gone = [len(one) for one in exploring.corpus_records(slow(), RANGES, ways)]
        assert measure_mcdc(slow(), [], ways, RANGES).steps == sum(gone)
        assert (max(gone) == most) == bool(most)
