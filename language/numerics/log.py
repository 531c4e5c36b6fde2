"""Logarithm: the natural logarithm as a list of exact operations (rule C5), as in sin_cos_tanh.py.

The errors in `about` were measured: in float32 by the tests against mpmath at every number of the
domain (0.84 ULP), in float64 once at 6 * 10^7 numbers against the 64 bits of x87 (0.86 ULP).
"""

from __future__ import annotations

from dataclasses import dataclass

from language.ir.number_type import MAX_FINITE
from language.ir.ops import Compare, Expr, Ref, Select, Value, add, divide, multiply, real, subtract
from language.ir.program import Function
from language.numerics.exp import LN_2
from language.numerics.sin_cos_tanh import FunctionBuilder, X, clamp, horner

LOG_SERIES = (
    0.6666666666666736,
    0.39999999999405483,
    0.28571428744061894,
    0.22222198426151224,
    0.18183571057432849,
    0.15313895728652202,
    0.1479736350587642,
)
"""Coefficients of (log((1 + s) / (1 - s)) - 2 s) / s^3, degree 6 in s^2, |s| <= 3 - 2 sqrt 2.

The error of log is 2^-59.4. Least squares at 60 Chebyshev nodes by mpmath at 50 digits, weight s^2.
The lowest coefficient is rounded to double and fixed, the others are fitted again, and so on
upwards.
"""
LOG_SERIES_FLOAT32 = (0.6666677594184875, 0.399775892496109, 0.29870572686195374)
"""The same series with degree 2, rounded to float32; error of log 2^-30.2."""


@dataclass(frozen=True)
class LogConstants:
    """The constants of log for one number type.

    `lowest_exponent` is the exponent of the smallest normal number. `steps` are the exponents of
    the powers of two that bring a number from 1 on below 2. `ln_2` has two parts; the product of
    the first one and any exponent is exact.
    """

    lowest_exponent: int
    steps: tuple[int, ...]
    largest: float
    sqrt_2: float
    series: tuple[float, ...]
    ln_2: tuple[Value, Value]


LOG_FLOAT64 = LogConstants(
    -1022,
    (512, 256, 128, 64, 32, 16, 8, 4, 2, 1),
    MAX_FINITE["float64"],
    1.4142135623730951,
    LOG_SERIES,
    LN_2,
)


def build_log(constants: LogConstants = LOG_FLOAT64) -> Function:
    """Return the Function `log` of `x`: log x = k ln 2 + log m, sqrt 1/2 < m <= sqrt 2.

    Method of fdlibm, e_log.c (Sun Microsystems 1993). With f = m - 1, which is exact, and s = f /
    (2 + f), log m is f - (f^2/2 - s (f^2/2 + r)), where s r is the remainder of the series of
    log((1 + s) / (1 - s)). x is clamped to the positive normal numbers, so 0 and negative numbers
    give the log of the smallest one.
    """
    body = FunctionBuilder()
    k, f = append_frexp(body, X, constants)
    s = body.let("s", divide(f, add(real(2.0), f)))
    square = body.let("square", multiply(s, s))
    series = body.let("series", multiply(square, horner(constants.series, square)))
    half = body.let("half", multiply(multiply(real(0.5), f), f))
    tail = add(multiply(s, add(half, series)), multiply(k, constants.ln_2[1]))
    body.let("y", subtract(multiply(k, constants.ln_2[0]), subtract(subtract(half, tail), f)))
    about = f"natural logarithm; 2^{constants.lowest_exponent} <= x, clamped; error < 0.9 ULP"
    return body.build("log", about)


def append_frexp(body: FunctionBuilder, x: Expr, constants: LogConstants) -> tuple[Ref, Ref]:
    """Append the decomposition of x and return (k, f): clamped x = 2^k (1 + f), exactly.

    x is clamped to the positive normal numbers, and sqrt 1/2 < 1 + f <= sqrt 2. A number below 1 is
    first multiplied by a power of two; then repeated comparison and scaling by `steps` finds k.
    """
    smallest = real(2.0**constants.lowest_exponent)
    m = body.let("bounded", clamp(x, smallest, real(constants.largest)))
    is_large = Compare(">=", m, real(1.0))
    k: Ref = body.let("k_0", Select(is_large, real(0.0), real(float(constants.lowest_exponent))))
    m = body.let("m_0", Select(is_large, m, multiply(m, real(2.0**-constants.lowest_exponent))))
    for step in constants.steps:
        is_below = Compare("<", m, real(2.0**step))
        k = body.let(f"k_{step}", Select(is_below, k, add(k, real(float(step)))))
        m = body.let(f"m_{step}", Select(is_below, m, multiply(m, real(2.0**-step))))
    is_below = Compare("<=", m, real(constants.sqrt_2))
    k = body.let("k", Select(is_below, k, add(k, real(1.0))))
    f = body.let("f", subtract(Select(is_below, m, multiply(real(0.5), m)), real(1.0)))
    return k, f
