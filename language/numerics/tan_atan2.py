"""Tangent and arctangent: tan and atan2 as lists of exact operations (rule C5).

The methods are described in sin_cos_tanh.py.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass

from language.ir.ops import (
    Call,
    Compare,
    Expr,
    Ref,
    Select,
    Unary,
    add,
    divide,
    multiply,
    real,
    subtract,
)
from language.ir.program import Function
from language.numerics.sin_cos_tanh import (
    TRIG_FLOAT64,
    FunctionBuilder,
    TrigConstants,
    X,
    horner_in_pieces,
    select_by_quadrant,
)

ATAN_SERIES = (
    -0.33333333333333315,
    0.19999999999993207,
    -0.1428571428485282,
    0.1111111105648321,
    -0.09090907060773325,
    0.07692259559725971,
    -0.06665902517390095,
    0.05874015985430291,
    -0.05200077063553983,
    0.0443291101751916,
    -0.03191434577731975,
    0.013690660605251368,
)
"""Coefficients of (atan r / r - 1) / r^2, degree 11 in r^2, |r| <= 7/16.

The error of atan r / r is 2^-62.3. Least squares at 60 Chebyshev nodes by mpmath at 50 digits,
weight r^2.
The lowest coefficient is rounded to double and fixed, the others are fitted again, and so on
upwards.
"""
ATAN_BASES = {
    "ahead": (
        (0.0, 0.0),
        (0.4636476090008061, 2.2698777452961687e-17),
        (0.7853981633974483, 3.061616997868383e-17),
    ),
    "behind": (
        (3.141592653589793, 1.2246467991473532e-16),
        (2.677945044588987, 1.5527705369303147e-16),
        (2.356194490192345, 9.184850993605148e-17),
    ),
    "steep": (
        (1.5707963267948966, 6.123233995736766e-17),
        (1.1071487177940904, 9.40447137356638e-17),
        (0.7853981633974483, 3.061616997868383e-17),
    ),
    "steep behind": (
        (1.5707963267948966, 6.123233995736766e-17),
        (2.0344439357957027, 2.841996617907152e-17),
        (2.356194490192345, 9.184850993605148e-17),
    ),
}
"""0, pi, pi/2 and pi/2, plus or minus 0, atan 1/2 and pi/4, each in two parts within 2^-106."""


@dataclass(frozen=True)
class Atan2Constants:
    """The constants of atan2 for one number type; only infinities are above `largest`.

    Sizes above `huge` are multiplied by `scale`, so that their sum is finite.
    """

    series: tuple[float, ...]
    bases: Mapping[str, tuple[tuple[float, float], ...]]
    huge: float
    scale: float
    largest: float


ATAN2_FLOAT64 = Atan2Constants(ATAN_SERIES, ATAN_BASES, 2.0**1000, 2.0**-100, sys.float_info.max)
RISE, RUN = Ref("work.rise"), Ref("work.run")


def build_tan(constants: TrigConstants = TRIG_FLOAT64) -> Function:
    """Return the Function `tan` of `x` [rad].

    The result is sin / cos of the reduced argument, in odd quadrants -cos / sin. It is x itself for
    |x| below `tiny`.
    """
    body = FunctionBuilder()
    quadrant, head, tail = constants.reduce_angle(body)
    sin, cos = constants.kernels(body, head, tail)
    even, odd = divide(sin, cos), Unary("-", divide(cos, sin))
    turned = select_by_quadrant(quadrant, even, odd, even, odd)
    body.let("y", Select(Compare("<", Call("abs", (X,)), constants.tiny), X, turned))
    return body.build("tan", "tangent; every x; error < 2.4 ULP")


def build_atan2(constants: Atan2Constants = ATAN2_FLOAT64) -> Function:
    """Return the Function `atan2` of `rise` and `run`; its value is in (-pi, pi], 0 for (0, 0).

    atan t, t in [0, 1], about 0, 1/2 or 1 (Cody and Waite 1980, chapter 11); t is the smaller size
    over the larger one. atan t = atan a + atan r with r = (t - a) / (1 + t a), computed from the
    sizes: its numerator is exact (Sterbenz). The sizes are scaled down where their sum would be
    infinite. The sign of a zero counts only where the zero is the value: atan2(-0.0, 1) = -0.0.
    """
    body = FunctionBuilder()
    up, along = body.let("up", Call("abs", (RISE,))), body.let("along", Call("abs", (RUN,)))
    steep, behind = Compare(">", up, along), Compare("<", RUN, real(0.0))
    low, high = scale_pair(body, constants, Select(steep, along, up), Select(steep, up, along))
    near = Compare("<", multiply(real(16.0), low), multiply(real(7.0), high))
    middle = Compare("<", multiply(real(16.0), low), multiply(real(11.0), high))
    half = subtract(add(low, low), high), add(add(high, high), low)
    one = subtract(low, high), add(high, low)
    top = body.let("top", Select(near, low, Select(middle, half[0], one[0])))
    below = body.let("below", Select(near, high, Select(middle, half[1], one[1])))
    # If both sizes are 0 the quotient becomes 0 / 1. A NaN stays a NaN.
    safe = Select(Compare("<=", high, real(0.0)), real(1.0), below)
    r = body.let("r", divide(top, safe))
    square = body.let("square", multiply(r, r))
    series = horner_in_pieces(body, constants.series, square)
    core = body.let("core", add(r, multiply(multiply(r, square), series)))
    turn = body.let("turn", Select(steep, Unary("-", core), core))
    arc = body.let("arc", Select(behind, Unary("-", turn), turn))

    def base(part: int) -> Expr:
        """Return the expression of one part of the angle at which the series starts."""
        by_bracket = {
            name: Select(near, real(a[part]), Select(middle, real(b[part]), real(c[part])))
            for name, (a, b, c) in constants.bases.items()
        }
        level = Select(behind, by_bracket["behind"], by_bracket["ahead"])
        return Select(steep, Select(behind, by_bracket["steep behind"], by_bracket["steep"]), level)

    first, rest = body.let("first", base(0)), body.let("rest", base(1))
    size = body.let("size", add(first, add(rest, arc)))
    flat = Select(Compare(">=", RUN, real(0.0)), RISE, size)
    half_turn = Select(Compare("<", RISE, real(0.0)), Unary("-", size), size)
    body.let("y", Select(Compare("<=", up, real(0.0)), flat, half_turn))
    about = "angle of (run, rise), in (-pi, pi] rad; error < 1.5 ULP"
    return body.build("atan2", about, ("rise", "run"))


def scale_pair(
    body: FunctionBuilder, constants: Atan2Constants, smaller: Expr, larger: Expr
) -> tuple[Ref, Ref]:
    """Append two sizes `low` and `high` with the quotient of `smaller` and `larger`; return both.

    Their sum is finite: if `larger` is above `huge`, both are multiplied by `scale`. If both are
    infinite both become 1; if only `larger` is, the sizes become 0 and 1.
    """
    least, most = body.let("least", smaller), body.let("most", larger)
    factor = body.let(
        "factor", Select(Compare(">", most, real(constants.huge)), real(constants.scale), real(1.0))
    )
    largest = real(constants.largest)
    endless = Compare(">", most, largest)
    at_limit = Select(Compare(">", least, largest), real(1.0), multiply(least, real(0.0)))
    low = Select(endless, at_limit, multiply(least, factor))
    high = Select(endless, real(1.0), multiply(most, factor))
    return body.let("low", low), body.let("high", high)
