"""Exponential: exp as a list of exact operations, as described in sin_cos_tanh.py (rule C5)."""

from __future__ import annotations

from dataclasses import dataclass

from language.ir.ops import Call, Compare, Expr, Ref, Select, Value, add, multiply, real, subtract
from language.ir.program import Function
from language.numerics.sin_cos_tanh import (
    ROUNDING_CONSTANT,
    FunctionBuilder,
    X,
    clamp,
    horner_in_pieces,
    round_to_nearest,
)

EXP_LOWEST, EXP_HIGHEST = real(-708.0), real(709.0)
"""Bounds of the argument: within them e^x is finite and normal, its power of two in -1021..1023."""
PER_LN_2 = real(1.4426950408889634)
LN_2 = real(0.6931471805598903), real(5.497923018708371e-14)
"""ln 2 in two parts; the first is a multiple of 2^-42, so its multiples up to 2^10 are exact."""
EXP_SERIES = (
    0.5000000000000011,
    0.16666666666666466,
    0.041666666666528816,
    0.00833333333347021,
    0.0013888888943694578,
    0.00019841269546225928,
    2.4801493177744308e-05,
    2.7557558513417143e-06,
    2.763019225057943e-07,
    2.5007202378603645e-08,
)
"""Coefficients of (e^r - 1 - r) / r^2, degree 9 in r, |r| <= ln 2 / 2.

The error of e^r is 2^-57.9 relative. Minimax by mpmath at 60 digits (Lawson's weights). The lowest
coefficient is rounded to double and fixed, the others are fitted again, and so on upwards. The
error is that of the rounded coefficients.
"""


@dataclass(frozen=True)
class ExpConstants:
    """The constants of exp for one number type.

    Between `lowest` and `highest` the result is normal. `lowest_exponent` is the power of two at
    `lowest`; `rounding_constant` rounds to whole numbers.
    """

    lowest: Value
    highest: Value
    lowest_exponent: Value
    per_ln_2: Value
    ln_2: tuple[Value, Value]
    series: tuple[float, ...]
    rounding_constant: Value


EXP_FLOAT64 = ExpConstants(
    EXP_LOWEST, EXP_HIGHEST, real(-1021.0), PER_LN_2, LN_2, EXP_SERIES, ROUNDING_CONSTANT
)


def build_exp(constants: ExpConstants = EXP_FLOAT64) -> Function:
    """Return the Function `exp` of `x`: e^x = 2^k e^r, k whole, |r| <= ln 2 / 2.

    Cody and Waite 1980, Software Manual for the Elementary Functions. ln 2 has two parts; head = x
    - k ln2_1 is exact and r = head - tail. The sum 1 + (head + (r^2 p(r) - tail)) adds the large
    terms last (Muller 2016, Elementary Functions). x is clamped to [lowest, highest], in float64
    [-708, 709]: the result is never infinite, zero or subnormal.
    """
    body = FunctionBuilder()
    bounded = body.let("bounded", clamp(X, constants.lowest, constants.highest))
    body.let("y", append_exp(body, bounded, None, constants))
    span = f"{constants.lowest.value:g} <= x <= {constants.highest.value:g}"
    return body.build("exp", f"e^x; {span}, clamped; error < 0.95 ULP")


def append_exp(
    body: FunctionBuilder, bounded: Ref, rest: Expr | None, constants: ExpConstants
) -> Expr:
    """Append the operations of e^(bounded + rest) to a function and return the result expression.

    `bounded` lies within the bounds of exp, which is not checked; `rest` is much smaller, None for
    0. The result itself is not assigned; the locals are `exponent`, `head`, `tail`, `r`, `scaled`
    and those of the series.
    """
    power = round_to_nearest(multiply(bounded, constants.per_ln_2), constants.rounding_constant)
    # The comparison is false for a NaN, so that pow2 always gets a whole number.
    is_known = Compare(">", bounded, constants.lowest)
    exponent = body.let("exponent", Select(is_known, power, constants.lowest_exponent))
    head = body.let("head", subtract(bounded, multiply(exponent, constants.ln_2[0])))
    low = multiply(exponent, constants.ln_2[1])
    tail = body.let("tail", low if rest is None else subtract(low, rest))
    r = body.let("r", subtract(head, tail))
    series = horner_in_pieces(body, constants.series, r)
    curved = subtract(multiply(multiply(r, r), series), tail)
    scaled = body.let("scaled", add(real(1.0), add(head, curved)))
    return multiply(Call("pow2", (exponent,)), scaled)
