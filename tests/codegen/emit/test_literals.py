"""Literals: one rounding from the text of a spec to a number type, and no bit lost towards C."""

from __future__ import annotations

import math
import random
import re
import struct
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, strategies as st

import modewright as mw
from codegen.emit.c_expression import format_literal
from codegen.toolchain.compiler import compile_program, run_executable
from language.expressions.units import parse_unit
from language.ir.number_type import NUMBER_TYPES, NumberType, round_to_type
from modewright.api.simulation import program

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

typedef REAL real;

static const real compiled[] = {
VALUES
};

int main(void)
{
    static char line[64];

    for (size_t k = 0U; k < (sizeof compiled / sizeof compiled[0]); k++) {
        const real *const value = &compiled[k];
        real pair[2] = {*value, 0};

        if (fgets(line, (int)sizeof line, stdin) == NULL) {
            return EXIT_FAILURE;
        }
        pair[1] = READ(line, NULL);
        if (fwrite(pair, sizeof pair, 1U, stdout) != 1U) {
            return EXIT_FAILURE;
        }
    }
    return EXIT_SUCCESS;
}
"""


SPECIALS_SINGLE = (
    *(0.0, 1.0, 2.0**-149, 2.0**-126, 2.0**-126 - 2.0**-149, (2.0 - 2.0**-23) * 2.0**127),
    *(16777216.0, 33554432.0, 2.0**-24, 2.0**30, 8589973504.0, 1.1754943508222875e-38),
)
FORMATS: dict[NumberType, str] = {"float64": "d", "float32": "f"}


def random_reals(number: NumberType, count: int) -> list[float]:
    """Return finite reals of random bits: every exponent is as likely as any other."""
    draw = random.Random("literals")
    form = FORMATS[number]
    size = struct.calcsize(form)
    values = [struct.unpack(form, draw.randbytes(size))[0] for _ in range(2 * count)]
    return [value for value in values if math.isfinite(value)][:count]


def bits(value: float, number: NumberType = "float64") -> bytes:
    return struct.pack(f"<{FORMATS[number]}", value)


@pytest.mark.parametrize("number", NUMBER_TYPES)
def test_compiler_and_library_read_back_the_same_bits(number: NumberType, tmp_path: Path) -> None:
    specials = SPECIALS if number == "float64" else SPECIALS_SINGLE
    values = random_reals(number, COUNT) + [sign * x for x in specials for sign in (1.0, -1.0)]
    texts = [format_literal(value, number) for value in values]
    source = tmp_path / "reader.c"
    real, read = {"float64": ("double", "strtod"), "float32": ("float", "strtof")}[number]
    text = READER.replace("REAL", real).replace("READ", read)
    source.write_text(text.replace("VALUES", ",\n".join(texts)))
    compile_program([source], tmp_path / "reader")
    lines = "\n".join([*(text.removesuffix("F") for text in texts), ""])
    found = run_executable(tmp_path / "reader", lines.encode())
    assert found == b"".join(2 * bits(value, number) for value in values)


@pytest.mark.parametrize("name", ["estimator_float32", "ha_mathf"])
def test_every_literal_of_generated_float32_code_is_read_back(name: str, tmp_path: Path) -> None:
    """Of all literals in the code: the float that the compiler reads has that shortest decimal."""
    code = mw.generate("estimator_float32")[f"{name}.c"]
    texts = list(dict.fromkeys(re.findall(r"(?<![\w.])\d[\d.]*(?:e[-+]?\d+)?F\b", code)))
    assert len(texts) > 10
    source = tmp_path / "reader.c"
    text = READER.replace("REAL", "float").replace("READ", "strtof")
    source.write_text(text.replace("VALUES", ",\n".join(texts)))
    compile_program([source], tmp_path / "reader")
    lines = "\n".join([*(text.removesuffix("F") for text in texts), ""])
    found = run_executable(tmp_path / "reader", lines.encode())
    values = [struct.unpack_from("<f", found, 8 * k)[0] for k in range(len(texts))]
    assert [format_literal(value, "float32") for value in values] == texts
    assert found == b"".join(2 * bits(value, "float32") for value in values)


@given(st.floats(allow_nan=False, allow_infinity=False))
@example(5e-324)
@example(1e16)
@example(-0.0)
def test_a_literal_is_a_double_in_c_and_the_shortest_one(value: float) -> None:
    text = format_literal(value, "float64")
    assert bits(float(text)) == bits(value)
    assert "." in text or "e" in text
    assert len(text) <= len("-2.2250738585072014e-308")


@given(st.floats(allow_nan=False, allow_infinity=False, width=32))
@example(2.0**-149)
@example(16777216.0)
@example(-0.0)
def test_a_literal_is_a_float_in_c_and_the_shortest_one(value: float) -> None:
    text = format_literal(value, "float32")
    assert text.endswith("F") and ("." in text or "e" in text)
    assert bits(round_to_type(Fraction(text[:-1]), "float32"), "float32") == bits(
        value + 0.0, "float32"
    )
    shortest = np.format_float_scientific(np.float32(value), unique=True)
    assert Fraction(text[:-1]) == Fraction(shortest)
    assert text.startswith("-") == (math.copysign(1.0, value) < 0.0)


def test_truth_and_whole_numbers_have_literals_of_their_own() -> None:
    assert [format_literal(value, "float64") for value in (True, False, 0, 7, -3)] == [
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
    value = round_to_type(exact)
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
    assert round_to_type(middle) == even
    assert round_to_type(middle - hair) == low
    assert round_to_type(middle + hair) == high


def test_a_value_with_a_unit_is_rounded_once_not_twice() -> None:
    """1 km/h is 5/18 m/s: rounding factor and number each for itself gives other bits."""
    factor = parse_unit("km/h").factor
    texts = [f"{number}.{digit}" for number in range(1, 200) for digit in range(10)]
    once = [round_to_type(Fraction(text) * factor) for text in texts]
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
        + '\ninputs: {u: {unit: "1", range: [-9, 9]}}\nequations:\n'
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
