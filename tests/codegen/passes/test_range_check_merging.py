"""Gate: what C takes at once is what the Program takes one by one."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from codegen.emit.c_math import emit_math_files
from codegen.emit.c_module import emit_c_files
from codegen.emit.c_names import C_REAL_TYPE
from codegen.passes.range_check_merging import (
    LATCH,
    LATCH_EACH,
    WITHIN,
    fold_range_check,
    merge_range_checks,
)
from codegen.toolchain.compiler import FLAGS, compile_program, run_executable
from language.ir.number_type import NumberType
from language.ir.ops import Binary, Branch, Call, Compare, Expr, Ref, RunBlock, Unary, Value
from language.numerics.evaluate import evaluate
from modewright.api.simulation import program as shipped
from tests.language.spec_builders import program

X = Ref("x")
KEYS = """language: 1
automaton: keys
period: 10 ms
numbers: float64
inputs: {key: {type: enum, values: [parked, ready]}, level: {type: int, range: [0, 9]}}
initial: low
modes: {low: {transitions: {high: {when: key == ready and level > 2}}}, high: {}}
outputs: [mode]
"""


def between(low: float, high: float) -> Expr:
    return Binary("and", Compare(">=", X, Value(low)), Compare("<=", X, Value(high)))


@pytest.mark.parametrize("x", [0.0, -0.0, 2.0, -2.0, 5e-324, math.inf, -math.inf, math.nan])
def test_one_comparison_says_what_two_said(x: float) -> None:
    for value in (x, math.nextafter(x, math.inf), math.nextafter(x, -math.inf)):
        test = between(-2.0, 2.0)
        assert fold_range_check(test) == Compare("<=", Call("abs", (X,)), Value(2.0))
        assert evaluate(fold_range_check(test), {"x": value}) == evaluate(test, {"x": value})


@pytest.mark.parametrize(("low", "high"), [(-2.0, 3.0), (0.0, 2.0), (-2.0, 0.0), (-0.0, 2.0)])
def test_a_range_around_0_is_one_comparison_of_bits(low: float, high: float) -> None:
    assert fold_range_check(between(low, high)) == Call(WITHIN, (X, Value(low), Value(high)))


def test_outside_of_a_range_is_not_within_it() -> None:
    outside = Unary("not", between(-2.0, 3.0))
    assert fold_range_check(outside) == Unary("not", Call(WITHIN, (X, Value(-2.0), Value(3.0))))


@pytest.mark.parametrize(("low", "high"), [(2.0, 2.0), (2.0, -2.0), (1.0, 3.0), (-3.0, -1.0)])
def test_other_ranges_stay_two_comparisons(low: float, high: float) -> None:
    assert fold_range_check(between(low, high)) == between(low, high)


BITS = """\
#include <stdio.h>
#include "ha_math{suffix}.h"
static const {real} ends[][2] = {{
    {{-400.0, 2400.0}}, {{0.0, 3000.0}}, {{-0.0, 1.0}}, {{-2.5, 0.0}}, {{-1e-37, 3e38}},
    {{-3e38, 1e-40}}, {{0.0, 0.0}},
}};
int main(void)
{{
    uint{bits}_t seed = 1U;
    long differing = 0;
    for (long turn = 0; turn < 4000000; turn++) {{
        for (int k = 0; k < 7; k++) {{
            uint{bits}_t word = seed;
            {real} x, near = ends[k][turn & 1];
            if ((turn & 2) != 0) {{
                (void)memcpy(&word, &near, sizeof word);
                word += (uint{bits}_t)((turn >> 2) % 9 - 4);
                word ^= ((turn & 1024) != 0) ? (uint{bits}_t)1U << {top} : 0U;
            }}
            (void)memcpy(&x, &word, sizeof x);
            differing += ha_within{suffix}(x, ends[k][0], ends[k][1])
                != ((x >= ends[k][0]) && (x <= ends[k][1]));
        }}
        seed = seed * {multiplier}U + 12345U;
    }}
    printf("%ld", differing);
    return 0;
}}
"""


@pytest.mark.parametrize(
    ("number", "suffix", "bits", "multiplier"),
    [("float32", "f", 32, 1664525), ("float64", "", 64, 6364136223846793005)],
)
def test_bits_say_what_two_comparisons_say(
    tmp_path: Path, number: NumberType, suffix: str, bits: int, multiplier: int
) -> None:
    """Any bits, NaN and infinities among them, and those around the ends."""
    filled = {"suffix": suffix, "real": C_REAL_TYPE[number], "bits": bits, "top": bits - 1}
    text = BITS.format(**filled, multiplier=multiplier)
    for name, source in {**emit_math_files(number), "main.c": text}.items():
        (tmp_path / name).write_text(source)
    sources = [tmp_path / name for name in ("main.c", f"ha_math{suffix}.c")]
    compile_program(sources, tmp_path / "main", [*FLAGS, "-w"])
    assert run_executable(tmp_path / "main", b"") == b"0"


def test_inputs_are_taken_at_once_or_each_apart() -> None:
    made = shipped("estimator")
    blocks = merge_range_checks(made).blocks
    (taken,) = blocks[LATCH]
    assert isinstance(taken, Branch)
    assert len(taken.then) == len(blocks[LATCH_EACH]) == len(made.blocks[LATCH]) > 1
    assert taken.other == (RunBlock(LATCH_EACH),)


def test_a_word_of_an_enumeration_is_not_asked_whether_it_is_below_0() -> None:
    """It is unsigned in C: gcc -Wextra warns of such a comparison."""
    made = program(KEYS)
    text = emit_c_files(made)["keys.c"]
    assert text.count("in->key <= keys_key_ready") == text.count("in->level <= 9") == 2
    assert text.count("in->level >= 0") == 2
    assert ">= keys_key" not in text
