"""Borders: the numbers on both sides of where an input makes another mode follow."""

from __future__ import annotations

import math
import shutil
import struct

import pytest

from codegen.coverage.boundary_values import (
    MAX_PER_CHANGE,
    NEIGHBOUR_COUNT,
    generate_boundary_sequences,
)
from codegen.coverage.mcdc import COVERAGE_EXPORTER, measure_mcdc
from language.ir.number_type import ROUNDING_FUNCTIONS, NumberType
from language.ir.program import Program
from tests.language.spec_builders import program

BELT = """language: 1
automaton: belt
period: 10 ms
numbers: {numbers}
inputs: {{u: {{unit: "1", range: [0, 6]}}, v: {{unit: "1", range: [0, 6]}}}}
states: {{x: {{unit: "1", initial: 0, range: [-100, 100]}}}}
initial: slow
modes:
  slow: {{transitions: {{fast: {{when: "{guard}"}}}}}}
  fast: {{transitions: {{slow: {{when: u < 1}}}}}}
outputs: [mode]
"""
RECORD = struct.Struct("<3d")
RANGES = {"u": (0.0, 6.0), "v": (0.0, 6.0)}
HELD = "previous(u) > 2.6"


def belt(guard: str, numbers: NumberType = "float64") -> Program:
    return program(BELT.format(guard=guard, numbers=numbers))


def sequence(*us: float) -> list[bytes]:
    return [RECORD.pack(u, 1.0, 0.0) for u in us]


@pytest.mark.parametrize("numbers", ["float64", "float32"])
def test_the_numbers_on_both_sides_of_a_threshold(numbers: NumberType) -> None:
    found = list(
        generate_boundary_sequences(belt("u > 2.6", numbers), [sequence(0.0, 4.0)], RANGES)
    )
    assert all(len(one) == 2 and one[0] == sequence(0.0)[0] for one in found)
    values = sorted(RECORD.unpack(one[1])[0] for one in found)
    cast = ROUNDING_FUNCTIONS[numbers]
    threshold, ulp = cast(2.6), 2.0 ** (1 - (52 if numbers == "float64" else 23))
    expected = [threshold + k * ulp for k in range(1 - NEIGHBOUR_COUNT, NEIGHBOUR_COUNT + 1)]
    assert values == expected and math.ulp(2.6) == 2.0**-51


def test_an_input_of_the_tick_before() -> None:
    found = list(generate_boundary_sequences(belt(HELD), [sequence(0.0, 4.0, 4.0)], RANGES))
    assert found and all(len(one) == 3 for one in found)
    at = {RECORD.unpack(one[1])[0] for one in found}
    assert {2.6, math.nextafter(2.6, 3.0)} <= at
    assert {RECORD.unpack(one[2])[0] for one in found} == {4.0}


def test_so_many_of_one_kind_and_none_after_a_new_page() -> None:
    often = sequence(*[0.0, 4.0] * 9)
    kinds = 2 * 2  # two ways between the modes, by the value on either side
    assert (
        len(list(generate_boundary_sequences(belt("u > 2.6"), [often], RANGES)))
        <= kinds * MAX_PER_CHANGE * 2 * NEIGHBOUR_COUNT
    )
    paged = [*sequence(0.0), RECORD.pack(4.0, 1.0, 1.0) + bytes(8), *sequence(0.0, 4.0)]
    assert not list(generate_boundary_sequences(belt("u > 2.6"), [paged], RANGES))


def test_what_is_not_a_number_has_no_border() -> None:
    assert not list(
        generate_boundary_sequences(belt("not (u < 2.6)"), [sequence(0.0, math.nan)], RANGES)
    )


@pytest.mark.long
@pytest.mark.skipif(
    not shutil.which(COVERAGE_EXPORTER), reason="no llvm-cov-19: make system-packages"
)
def test_a_condition_that_only_the_border_shows() -> None:
    """`u >= 2.6` decides where u is 2.6 itself, which no value of the sequence is near."""
    spec, given = belt("u > 2.6 or u >= 2.6 and v > 0"), [sequence(0.0, 4.0, 0.0)]
    guard = "(self->latched.u > 2.6) || ((self->latched.u >= 2.6) && (self->latched.v > 0.0))"
    shown = {d.text: d.shown for d in measure_mcdc(spec, given).decisions}
    assert shown[guard] == (True, False, False)
    bordered = [*given, *generate_boundary_sequences(spec, given, RANGES)]
    assert {d.text: d.shown for d in measure_mcdc(spec, bordered).decisions}[guard] == (
        True,
        True,
        False,
    )
