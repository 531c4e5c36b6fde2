"""Float32 constants: the numbers of the elementary functions in float32 (rule C5).

The methods, clamps and symmetries are those of float64; the series have fewer terms, and every
number is a float32. sin and cos are reduced by four parts of pi/2, because 24 bits leave less room
for exact products. The errors in `about`, in ULP of the exact result, were measured at every
float32 of the domain (tests/language).
"""

from __future__ import annotations

from functools import partial

from language.ir.number_type import MAX_FINITE
from language.ir.ops import Ref, add, multiply, real, subtract
from language.numerics.exp import ExpConstants
from language.numerics.log import LOG_SERIES_FLOAT32, LogConstants
from language.numerics.pow import PowConstants
from language.numerics.sin_cos_tanh import (
    FunctionBuilder,
    TanhConstants,
    TrigConstants,
    count_quarter_turns,
    select_reduction,
    sin_cos_kernels,
)
from language.numerics.tan_atan2 import Atan2Constants

ROUNDING_CONSTANT = real(1.5 * 2.0**23)
"""Adding and subtracting it rounds |x| < 2^22 to the nearest integer, ties to even (rule C5)."""
TINY_ARGUMENT = real(2.0**-13)
"""Below it sin x and tanh x equal x to 2^-26 / 3 relative; -0.0 and subnormals are kept."""

EXP_LOWEST, EXP_HIGHEST = real(-87.0), real(88.0)
"""Bounds of the argument: within them e^x is finite and normal, its power of two in -126..127."""
PER_LN_2 = real(1.4426950216293335)
LN_2 = real(0.693145751953125), real(1.428606765330187e-06)
"""ln 2 in two parts; the first is a multiple of 2^-15, so its multiples up to 2^8 are exact."""
EXP_SERIES = (
    0.4999999403953552,
    0.16666509211063385,
    0.041668009012937546,
    0.008369989693164825,
    0.0013847037917003036,
)
"""Coefficients of (e^r - 1 - r) / r^2, degree 4 in r, |r| <= ln 2 / 2.

The error of e^r is 2^-28.1 relative. This and the next two: minimax by mpmath at 40 digits (Remez
exchange). The lowest coefficient is rounded to float32 and fixed, the others are fitted again, and
so on upwards.
"""

MAX_ANGLE = 1000.0
"""Bound of the angles [rad] that are reduced by parts of pi/2: 637 quarter turns, below 2^10."""
TWO_OVER_PI = real(0.6366197466850281)
HALF_PI_PARTS = (
    real(1.57080078125),
    real(-4.455447196960449e-06),
    real(9.922587196342647e-10),
    real(-1.6513995574653217e-13),
)
"""pi/2 in four parts, together within 2^-68.

The first three are multiples of 2^-13, 2^-27 and 2^-41 with at most 14 bits, so their products with
a number of quarter turns are exact.
"""
SIN_SERIES = (-0.16666653752326965, 0.00833209604024887, -0.00019505627278704196)
"""Coefficients of (sin r / r - 1) / r^2, degree 2 in r^2, |r| <= pi/4.

The error of sin r / r is 2^-27.7.
"""
COS_SERIES = (0.04166664555668831, -0.0013887288514524698, 2.4428207325399853e-05)
"""Coefficients of (cos r - 1 + r^2 / 2) / r^4, degree 2 in r^2, |r| <= pi/4.

The error of cos r is 2^-32.8.
"""

TANH_SATURATION = real(10.0)
"""tanh x rounds to 1 for x >= 9.02."""
LAMBERT_NUMERATOR = (315.0, 14.0)
LAMBERT_DENOMINATOR = (945.0, 420.0, 15.0)
"""Coefficients of numerator and denominator of (x - tanh x) / (x z), z = x^2.

Lambert's continued fraction x/(1 + z/(3 + z/(5 + z/(7 + z/9)))), within 2^-30 of x up to 0.625.
"""


def reduce_angle_float32(body: FunctionBuilder) -> tuple[Ref, Ref, Ref]:
    """Append the reduction of x by multiples of pi/2 and return (quadrant 0 1 2 3, head, tail).

    x is head + tail beyond a multiple of pi/2. `coarse`, `fine` and `finer` are exact. Two
    differences with their rounding errors (Dekker's fast two-sum) leave head + tail within 2^-56 of
    the reduced argument, which is 2^-30 or more. Angles above MAX_ANGLE are reduced by integers.
    """
    bounded, quarters, quadrant = count_quarter_turns(
        body, MAX_ANGLE, TWO_OVER_PI, ROUNDING_CONSTANT
    )
    coarse = body.let("coarse", subtract(bounded, multiply(quarters, HALF_PI_PARTS[0])))
    fine = body.let("fine", multiply(quarters, HALF_PI_PARTS[1]))
    finer = body.let("finer", multiply(quarters, HALF_PI_PARTS[2]))
    first = body.let("first", subtract(coarse, fine))
    lost = body.let("lost", subtract(subtract(coarse, first), fine))
    near = body.let("near", subtract(first, finer))
    rest = body.let("rest", subtract(subtract(first, near), finer))
    last = subtract(add(lost, rest), multiply(quarters, HALF_PI_PARTS[3]))
    return select_reduction(body, MAX_ANGLE, (quadrant, near, last))


TRIG_FLOAT32 = TrigConstants(
    reduce_angle_float32,
    partial(sin_cos_kernels, sine_series=SIN_SERIES, cosine_series=COS_SERIES),
    TINY_ARGUMENT,
)
EXP_FLOAT32 = ExpConstants(
    EXP_LOWEST, EXP_HIGHEST, real(-126.0), PER_LN_2, LN_2, EXP_SERIES, ROUNDING_CONSTANT
)
TANH_FLOAT32 = TanhConstants(LAMBERT_NUMERATOR, LAMBERT_DENOMINATOR, TANH_SATURATION, TINY_ARGUMENT)
ATAN2_FLOAT32 = Atan2Constants(
    series=(
        -0.33333301544189453,
        0.19997620582580566,
        -0.14227403700351715,
        0.1047528013586998,
        -0.05781654268503189,
    ),
    bases={
        "ahead": (
            (0.0, 0.0),
            (0.46364760398864746, 5.01215868808913e-09),
            (0.7853981852531433, -2.1855694143368964e-08),
        ),
        "behind": (
            (3.1415927410125732, -8.742277657347586e-08),
            (2.677945137023926, -9.243493792610025e-08),
            (2.356194496154785, -5.962440319251527e-09),
        ),
        "steep": (
            (1.5707963705062866, -4.371138828673793e-08),
            (1.1071487665176392, -4.872354963936232e-08),
            (0.7853981852531433, -2.1855694143368964e-08),
        ),
        "steep behind": (
            (1.5707963705062866, -4.371138828673793e-08),
            (2.0344438552856445, 8.051005551124035e-08),
            (2.356194496154785, -5.962440319251527e-09),
        ),
    },
    huge=2.0**120,
    scale=2.0**-20,
    largest=(2.0 - 2.0**-23) * 2.0**127,
)
"""Constants of atan2 as in tan_atan2.py.

The series is (atan r / r - 1) / r^2, degree 4 in r^2; error of atan r / r 2^-29.4.
"""
LOG_FLOAT32 = LogConstants(
    -126,
    (64, 32, 16, 8, 4, 2, 1),
    MAX_FINITE["float32"],
    1.4142135381698608,
    LOG_SERIES_FLOAT32,
    LN_2,
)
"""Constants of log in float32."""
POW_FLOAT32 = PowConstants("float32", LOG_FLOAT32, EXP_FLOAT32, 6, 2.0**12 + 1.0)
