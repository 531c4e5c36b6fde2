"""Literals: one rounding from the text of a spec to a double, and no bit lost on the way to C."""

from __future__ import annotations

import math
import random
import struct
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import example, given, strategies as st

import modewright as mw
from codegen.build import compile_program, run_executable
from codegen.expression import literal
from language.lower import rounded
from language.units import parse_unit
from modewright.api import program

COUNT = 2000
SPECIALS = (
    *(0.0, 1.0, 0.1, 1.0 / 3.0, 5e-324, 2.0**-1022, math.nextafter(2.0**-1022, 0.0)),
    *(1e15, 1e16, 1e17, 123456789012345680.0, 1e22, 1e23, 2.0**53, 9007199254740993.0),
    *(1e-4, 1e-5, 1.7976931348623157e308, 2.2250738585072011e-308),
)
"""Doubles at the edges of formats: of repr, of the subnormals, of whole numbers."""
READER = """\
#include <stdio.h>
#include <stdlib.h>

static const double compiled[] = {
%s
};

int main(void)
{
    static char line[64];

    for (size_t k = 0U; k < (sizeof compiled / sizeof compiled[0]); k++) {
        const double *const value = &compiled[k];
        double pair[2] = {*value, 0.0};

        if (fgets(line, (int)sizeof line, stdin) == NULL) {
            return EXIT_FAILURE;
        }
        pair[1] = strtod(line, NULL);
        if (fwrite(pair, sizeof pair, 1U, stdout) != 1U) {
            return EXIT_FAILURE;
        }
    }
    return EXIT_SUCCESS;
}
"""


def random_doubles(count: int) -> list[float]:
    """Return finite doubles of random bits: every exponent is as likely as any other."""
    draw = random.Random("literals")
    patterns = (struct.pack("<Q", draw.getrandbits(64)) for _ in range(2 * count))
    values = [struct.unpack("<d", pattern)[0] for pattern in patterns]
    return [value for value in values if math.isfinite(value)][:count]


def bits(value: float) -> bytes:
    return struct.pack("<d", value)


def test_compiler_and_strtod_read_back_the_same_bits(tmp_path: Path) -> None:
    values = random_doubles(COUNT) + [sign * x for x in SPECIALS for sign in (1.0, -1.0)]
    texts = [literal(value) for value in values]
    source = tmp_path / "reader.c"
    source.write_text(READER % ",\n".join(texts))
    compile_program([source], tmp_path / "reader")
    read = run_executable(tmp_path / "reader", "\n".join([*texts, ""]).encode())
    assert read == b"".join(2 * bits(value) for value in values)


@given(st.floats(allow_nan=False, allow_infinity=False))
@example(5e-324)
@example(1e16)
@example(-0.0)
def test_a_literal_is_a_double_in_c_and_the_shortest_one(value: float) -> None:
    text = literal(value)
    assert bits(float(text)) == bits(value)
    assert "." in text or "e" in text
    assert len(text) <= len("-2.2250738585072014e-308")


def test_truth_and_whole_numbers_have_literals_of_their_own() -> None:
    assert [literal(value) for value in (True, False, 0, 7, -3)] == [
        "true",
        "false",
        "0",
        "7",
        "-3",
    ]


DECIMALS = st.builds(
    "{}.{}e{}".format, st.integers(0, 10**20), st.integers(0, 10**20), st.integers(-330, 280)
)


@given(DECIMALS)
@example("9007199254740993.0e0")
@example("2.4703282292062327e-324")
@example("2.4703282292062328e-324")
@example("2.2250738585072011e-308")
@example("179769313486231570000000000000000000000.0e270")
def test_a_decimal_text_becomes_the_nearest_double(text: str) -> None:
    exact = Fraction(Decimal(text))
    value = rounded(exact)
    assert bits(value) == bits(float(text))
    wrong = abs(Fraction(value) - exact)
    for neighbour in (math.nextafter(value, math.inf), math.nextafter(value, -math.inf)):
        if math.isfinite(neighbour):
            assert wrong <= abs(Fraction(neighbour) - exact)


@given(st.floats(min_value=0.0, max_value=1e308))
def test_a_tie_goes_to_the_even_double_and_a_hair_more_goes_up(low: float) -> None:
    high = math.nextafter(low, math.inf)
    middle = (Fraction(low) + Fraction(high)) / 2
    even = low if struct.unpack("<Q", bits(low))[0] % 2 == 0 else high
    hair = Fraction(1, 10**400)
    assert rounded(middle) == even
    assert rounded(middle - hair) == low
    assert rounded(middle + hair) == high


def test_a_value_with_a_unit_is_rounded_once_not_twice() -> None:
    """1 km/h is 5/18 m/s: rounding factor and number each for itself gives other bits."""
    factor = parse_unit("km/h").factor
    texts = [f"{number}.{digit}" for number in range(1, 200) for digit in range(10)]
    once = [rounded(Fraction(text) * factor) for text in texts]
    twice = [float(text) * float(factor) for text in texts]
    assert any(a != b for a, b in zip(once, twice, strict=True))
    for text, value in zip(texts, once, strict=True):
        exact = Fraction(text) * Fraction(5, 18)
        assert abs(Fraction(value) - exact) <= Fraction(math.ulp(value)) / 2


def spec_of(values: list[str], folder: Path) -> Path:
    lines = [f"  p{k}: {{value: {value}}}" for k, value in enumerate(values)]
    path = folder / "many.yaml"
    path.write_text(
        "language: 1\nautomaton: many\nperiod: 1 ms\nnumbers: float64\nparameters:\n"
        + "\n".join(lines)
        + '\ninputs: {u: {unit: "1"}}\nequations:\n'
        + "\n".join(f"  r{k}: u + p{k}" for k in range(len(values)))
        + "\nmodes: {only: {}}\noutputs: [r0]\n"
    )
    return path


def test_the_texts_of_a_spec_reach_the_c_code_as_the_nearest_doubles(tmp_path: Path) -> None:
    draw = random.Random("texts")
    texts = [
        f"{draw.randrange(10)}.{draw.randrange(10**25)}e{draw.randrange(-300, 300)}"
        for _ in range(50)
    ]
    path = spec_of(texts, tmp_path)
    constants = {c.name: c.value for c in program(str(path)).constants}
    code = mw.generate(str(path))["many.c"]
    for k, text in enumerate(texts):
        assert bits(constants[f"constant.p{k}"]) == bits(float(text))
        assert f".p{k} = {float(text)!r}," in code


@pytest.mark.parametrize("text", ["1.9e308 W", "1" + 400 * "0" + " W", "1.0e308 kW"])
def test_a_number_beyond_the_doubles_is_a_problem(text: str, tmp_path: Path) -> None:
    parameter = spec_of([text], tmp_path)
    assert mw.check(str(parameter))
    equation = spec_of(["1"], tmp_path)
    equation.write_text(equation.read_text().replace("r0: u + p0", f"r0: u + ({text}) / 1 W * p0"))
    assert mw.check(str(equation))
