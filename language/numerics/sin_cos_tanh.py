"""Sine, cosine, hyperbolic tangent: elementary functions as lists of exact operations (rule C5).

No library of mathematics is used, because its results depend on the processor and on the C library
(rule C6). The operations are + - * /, comparisons, selections, absolute values and exact powers of
two. IEEE 754 defines each of them to the last bit; compiled without contraction (rule C3), C gives
the bits of Python.

Arguments of tanh are clamped to its declared domain; sin, cos and tan accept every angle, and an
infinity as the largest number. A NaN gives a NaN, but never reaches `pow2`. sin and
tanh are odd and cos is even, bit for bit; sin and tanh of -0.0 are -0.0. The errors in `about`, in
ULP of the exact result, were measured: against mpmath by the test of this module, and once against
libquadmath at 10^8 arguments of each function. They hold on the whole domain, also at the zeros of
sin and cos.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from language.ir.ops import (
    Assign,
    Call,
    Compare,
    Expr,
    Op,
    Ref,
    Select,
    Unary,
    Value,
    add,
    divide,
    multiply,
    real,
    subtract,
)
from language.ir.program import Function

ROUNDING_CONSTANT = real(1.5 * 2.0**52)
"""Adding and subtracting it rounds |x| < 2^51 to the nearest integer, ties to even (rule C5)."""
TINY_ARGUMENT = real(2.0**-27)
"""Below it sin x and tanh x equal x to 2^-54 / 3 relative; -0.0 and subnormals are kept."""

MAX_ANGLE = 1e5
"""Bound of the angles [rad] that are reduced by parts of pi/2: 63 662 quarter turns, fewer than
2^16. Larger angles are reduced by payne_hanek.py."""
TWO_OVER_PI = real(0.6366197723675814)
HALF_PI_PARTS = real(1.5707963267923333), real(2.563344151689835e-12), real(-9.531611933980011e-23)
"""pi/2 in three parts, together within 2^-127; the first two are multiples of 2^-36 and 2^-72."""
SIN_SERIES = (
    -0.16666666666666632,
    0.00833333333332249,
    -0.000198412698298578,
    2.755731370700222e-06,
    -2.5050760240823352e-08,
    1.5896909130064357e-10,
)
"""Coefficients of (sin r / r - 1) / r^2, degree 5 in r^2, |r| <= pi/4; error of sin r / r 2^-58.0.

This and the next one: minimax by mpmath at 60 digits (Remez exchange). The lowest coefficient is
rounded to double and fixed, the others are fitted again, and so on upwards. The errors are those of
the rounded coefficients.
"""
COS_SERIES = (
    0.0416666666666666,
    -0.0013888888888874474,
    2.4801587289671533e-05,
    -2.7557314401028414e-07,
    2.0875729280773627e-09,
    -1.135993421169908e-11,
)
"""Coefficients of (cos r - 1 + r^2 / 2) / r^4, degree 5 in r^2, |r| <= pi/4.

The error of cos r is 2^-64.1.
"""

TANH_SATURATION = real(20.0)
"""tanh x rounds to 1 for x >= 19.07."""
TANH_SPLIT = real(0.625)
LAMBERT_NUMERATOR = (675675.0, 45045.0, 594.0, 1.0)
LAMBERT_DENOMINATOR = (2027025.0, 945945.0, 51975.0, 630.0, 1.0)
"""Coefficients of numerator and denominator of (x - tanh x) / (x z), z = x^2.

Lambert's continued fraction x/(1 + z/(3 + z/(5 + ... + z/15))), within 2^-56.9 of x up to 0.625;
its coefficients are whole numbers.
"""

PIECE_NAMES = ("series", "centre", "upper")
"""Local variables of a series, each with four coefficients."""

X = Ref("work.x")


@dataclass
class FunctionBuilder:
    """The assignments of a function under construction; each assigns a new local variable."""

    ops: list[Op] = field(default_factory=list)
    locals: list[str] = field(default_factory=list)

    def let(self, name: str, value: Expr) -> Ref:
        """Append `work.<name> := value` and return a reference to that new local variable.

        Whether the name was assigned before is not checked.
        """
        self.locals.append(name)
        self.ops.append(Assign(f"work.{name}", value))
        return Ref(f"work.{name}")

    def build(self, name: str, about: str, parameters: tuple[str, ...] = ("x",)) -> Function:
        """Return the function with the operations so far; its result is the local `y`.

        The caller must have assigned `y`, which is not checked.
        """
        return Function(name, tuple(self.ops), tuple(self.locals), about, parameters)


@dataclass(frozen=True)
class TrigConstants:
    """The constants and steps of sin, cos and tan for one number type.

    `reduce_angle` appends the argument reduction, `kernels` sin and cos of head + tail. Below
    `tiny`, sin and tan of x are x.
    """

    reduce_angle: Callable[[FunctionBuilder], tuple[Ref, Ref, Ref]]
    kernels: Callable[[FunctionBuilder, Ref, Ref], tuple[Ref, Ref]]
    tiny: Value


@dataclass(frozen=True)
class TanhConstants:
    """The constants of tanh for one number type.

    x - tanh x = x z numerator(z) / denominator(z), z = x^2. tanh x rounds to 1 from `saturation` on
    and is x below `tiny`.
    """

    numerator: tuple[float, ...]
    denominator: tuple[float, ...]
    saturation: Value
    tiny: Value


def round_to_nearest(x: Expr, rounding_constant: Value = ROUNDING_CONSTANT) -> Expr:
    """Return the expression of the whole number nearest to x, ties to even: (x + c) - c.

    c is the rounding constant of the number type.
    """
    return subtract(add(x, rounding_constant), rounding_constant)


def clamp(x: Expr, low: Expr, high: Expr) -> Expr:
    """Return the expression of x limited to [low, high]; a NaN stays a NaN.

    `clip` gives `low` for a NaN (rule C7).
    """
    return Select(Compare(">", x, high), high, Select(Compare("<", x, low), low, x))


def horner(coefficients: tuple[float, ...], x: Expr, rest: Expr | None = None) -> Expr:
    """Return the expression c0 + x (c1 + x (c2 + ... + x rest)); without `rest` the last sum is cn.

    If the last coefficient is 1 and there is no `rest`, it needs no product.
    """
    *lower, last = coefficients
    result: Expr = real(last) if rest is None else add(real(last), multiply(x, rest))
    for number in reversed(lower):
        result = add(real(number), x if result == real(1.0) else multiply(x, result))
    return result


def horner_in_pieces(body: FunctionBuilder, coefficients: tuple[float, ...], x: Expr) -> Expr:
    """Append a polynomial c0 + x (c1 + ...) as locals of at most four coefficients each.

    The locals are named by PIECE_NAMES, so that 12 coefficients are the most. The one with c0,
    `series`, is assigned last and returned.
    """
    rest: Expr | None = None
    for k in reversed(range(0, len(coefficients), 4)):
        rest = body.let(PIECE_NAMES[k // 4], horner(coefficients[k : k + 4], x, rest))
    assert rest is not None
    return rest


def reduce_angle(body: FunctionBuilder) -> tuple[Ref, Ref, Ref]:
    """Append the reduction of x by multiples of pi/2 and return (quadrant 0 1 2 3, head, tail).

    x is head + tail beyond a multiple of pi/2, |head| <= pi/4 (Cody and Waite 1980, with three
    parts of pi/2). `coarse` and `fine` are exact. The rounding error (coarse - head) - fine of head
    is exact, too: by Dekker's fast two-sum where |coarse| >= |fine|; else coarse - fine has at most
    52 bits. Near a multiple of pi/2 the reduced argument may be as small as 2^-60.5 (x =
    45.553...); head + tail has it to 2^-110. Angles above MAX_ANGLE are reduced by integers.
    """
    bounded, quarters, quadrant = count_quarter_turns(
        body, MAX_ANGLE, TWO_OVER_PI, ROUNDING_CONSTANT
    )
    coarse = body.let("coarse", subtract(bounded, multiply(quarters, HALF_PI_PARTS[0])))
    fine = body.let("fine", multiply(quarters, HALF_PI_PARTS[1]))
    near = body.let("near", subtract(coarse, fine))
    lost = body.let("lost", subtract(subtract(coarse, near), fine))
    rest = subtract(lost, multiply(quarters, HALF_PI_PARTS[2]))
    return select_reduction(body, MAX_ANGLE, (quadrant, near, rest))


def select_reduction(
    body: FunctionBuilder, bound: float, near: tuple[Expr, Expr, Expr]
) -> tuple[Ref, Ref, Ref]:
    """Append and return (quadrant, head, tail): `near` up to `bound` [rad], else by integers.

    A NaN gives `near`.
    """
    is_far = Compare(">", Call("abs", (X,)), real(bound))
    quadrant, head, tail = (
        body.let(name, Select(is_far, Call(f"reduced_{name}", (X,)), value))
        for name, value in zip(("quadrant", "head", "tail"), near, strict=True)
    )
    return quadrant, head, tail


def count_quarter_turns(
    body: FunctionBuilder, bound: float, two_over_pi: Value, rounding_constant: Value
) -> tuple[Ref, Ref, Ref]:
    """Append and return the clamped x, the nearest whole number of quarter turns, the quadrant.

    x is clamped to +-`bound` [rad]. The quadrant is 0, 1, 2 or 3. The locals are `bounded`,
    `quarters`, `turns` and `side`.
    """
    bounded = body.let("bounded", clamp(X, real(-bound), real(bound)))
    quarters = body.let(
        "quarters", round_to_nearest(multiply(bounded, two_over_pi), rounding_constant)
    )
    # quarters / 4 - 3/8 is never near a tie: it rounds to the floor of quarters / 4.
    past = subtract(multiply(real(0.25), quarters), real(0.375))
    turns = body.let("turns", round_to_nearest(past, rounding_constant))
    side = body.let("side", subtract(quarters, multiply(real(4.0), turns)))
    return bounded, quarters, side


def sin_cos_kernels(
    body: FunctionBuilder,
    head: Ref,
    tail: Ref,
    sine_series: tuple[float, ...] = SIN_SERIES,
    cosine_series: tuple[float, ...] = COS_SERIES,
) -> tuple[Ref, Ref]:
    """Append the series and return the locals (sin, cos) of head + tail, |head| <= pi/4.

    `tail` is so small that its square is left out: it adds tail (1 - head^2/2) to sin and -head
    tail to cos. The largest terms are added last (Muller 2016). The rounding error of the local
    `crest`, 1 - head^2/2, is computed exactly and added to cos.
    """
    square = body.let("square", multiply(head, head))
    half = body.let("half", multiply(real(0.5), square))
    crest = body.let("crest", subtract(real(1.0), half))
    cubic = multiply(multiply(head, square), _let_series(body, "sine", sine_series, square))
    sine = body.let("sine", add(head, add(multiply(tail, crest), cubic)))
    series = _let_series(body, "cosine", cosine_series, square)
    quartic = multiply(multiply(square, square), series)
    lost = subtract(subtract(real(1.0), crest), half)
    fringe = add(lost, subtract(quartic, multiply(head, tail)))
    cosine = body.let("cosine", add(crest, fringe))
    return sine, cosine


def _let_series(body: FunctionBuilder, name: str, coefficients: tuple[float, ...], x: Expr) -> Ref:
    """Append a polynomial as locals of three lower and all upper coefficients; return the first."""
    lower, upper = coefficients[:3], coefficients[3:]
    rest = body.let(f"{name}_upper", horner(upper, x)) if upper else None
    return body.let(f"{name}_series", horner(lower, x, rest))


def select_by_quadrant(quadrant: Expr, *values: Expr) -> Expr:
    """Return the expression that selects one of four values by quadrant 0, 1, 2 or 3.

    `values` are those of the quadrants 0 to 3. The comparisons are `< 0.5`, `< 1.5` and `< 2.5`; a
    NaN gives the last value.
    """
    result = values[3]
    for number in (2, 1, 0):
        result = Select(Compare("<", quadrant, real(number + 0.5)), values[number], result)
    return result


TRIG_FLOAT64 = TrigConstants(reduce_angle, sin_cos_kernels, TINY_ARGUMENT)


def build_sin(constants: TrigConstants = TRIG_FLOAT64) -> Function:
    """Return the Function `sin` of `x` [rad].

    The result is x itself for |x| below `tiny`, so that sin -0.0 is -0.0.
    """
    body = FunctionBuilder()
    quadrant, head, tail = constants.reduce_angle(body)
    sin, cos = constants.kernels(body, head, tail)
    turned = select_by_quadrant(quadrant, sin, cos, Unary("-", sin), Unary("-", cos))
    body.let("y", Select(Compare("<", Call("abs", (X,)), constants.tiny), X, turned))
    return body.build("sin", "sine; every x; error < 0.85 ULP")


def build_cos(constants: TrigConstants = TRIG_FLOAT64) -> Function:
    """Return the Function `cos` of `x` [rad]."""
    body = FunctionBuilder()
    quadrant, head, tail = constants.reduce_angle(body)
    sin, cos = constants.kernels(body, head, tail)
    body.let("y", select_by_quadrant(quadrant, cos, Unary("-", sin), Unary("-", cos), sin))
    return body.build("cos", "cosine; every x; error < 0.85 ULP")


TANH_FLOAT64 = TanhConstants(LAMBERT_NUMERATOR, LAMBERT_DENOMINATOR, TANH_SATURATION, TINY_ARGUMENT)


def build_tanh(constants: TanhConstants = TANH_FLOAT64) -> Function:
    """Return the Function `tanh` of `x` (Cody and Waite 1980); it calls `exp`.

    Lambert's fraction below 0.625, above it 1 - 2 / (e^2x + 1). Both are computed for |x|, limited
    to `saturation`, and get the sign of x; the result is x itself for |x| below `tiny`, so that
    tanh -0.0 is -0.0.
    """
    body = FunctionBuilder()
    full = constants.saturation
    size = body.let("size", Call("abs", (X,)))
    bounded = body.let("bounded", Select(Compare(">", size, full), full, size))
    square = body.let("square", multiply(bounded, bounded))
    above = body.let("above", horner(constants.numerator, square))
    below = body.let("below", horner(constants.denominator, square))
    low = subtract(bounded, divide(multiply(multiply(bounded, square), above), below))
    power = Call("exp", (add(bounded, bounded),))
    high = subtract(real(1.0), divide(real(2.0), add(power, real(1.0))))
    split = Compare("<", bounded, TANH_SPLIT)
    magnitude = body.let("magnitude", Select(split, low, high))
    signed = Select(Compare("<", X, real(0.0)), Unary("-", magnitude), magnitude)
    body.let("y", Select(Compare("<", size, constants.tiny), X, signed))
    return body.build("tanh", "hyperbolic tangent; every x; error < 1.4 ULP")
