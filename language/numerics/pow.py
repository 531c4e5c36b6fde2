"""Power: pow(base, degree) as a list of exact operations (rule C5), as in sin_cos_tanh.py.

It is e^(y log x). log x and its product with y are double words: sums of two numbers, the second of
which is the rounding error of the first. A single number would lose as many bits as y log x has
before its binary point. Sums and products with their errors are those of Dekker 1971 (Numerische
Mathematik 18), which need no fused multiplication. The errors in `about` were measured against
mpmath.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from language.ir.number_type import NumberType, round_to_type
from language.ir.ops import (
    Binary,
    Compare,
    Expr,
    Ref,
    Select,
    Value,
    add,
    divide,
    multiply,
    real,
    subtract,
)
from language.ir.program import Function
from language.numerics.exp import EXP_FLOAT64, ExpConstants, append_exp
from language.numerics.log import LOG_FLOAT64, LogConstants, append_frexp
from language.numerics.sin_cos_tanh import FunctionBuilder, clamp, horner

BASE, DEGREE = Ref("work.base"), Ref("work.degree")
MAX_DEGREE = 2.0**60
"""Largest size of the exponent; beyond it even the neighbours of 1 overflow in float64."""


@dataclass(frozen=True)
class PowConstants:
    """The constants of pow for one number type.

    `terms` is the number of terms of the series of log; `splitter` splits a number into two halves
    whose products are exact.
    """

    number_type: NumberType
    log: LogConstants
    exp: ExpConstants
    terms: int
    splitter: float


POW_FLOAT64 = PowConstants("float64", LOG_FLOAT64, EXP_FLOAT64, 12, 2.0**27 + 1.0)


def build_pow(constants: PowConstants = POW_FLOAT64) -> Function:
    """Return the Function `pow` of `base` and `degree`: x^y = e^(y log x) for x > 0.

    x <= 0 gives 0 for y > 0, and else counts as the smallest normal number. y is clamped to
    +-MAX_DEGREE and y log x to the bounds of exp. log x = k ln 2 + log m as in log.py, log m = 2 s
    + s^3 (2/3 + 2/5 s^2 + ...) with s = (m - 1) / (m + 1). The first two terms are double words,
    the others are not.
    """
    body = FunctionBuilder()
    double_words = _DoubleWordBuilder(body, constants.splitter)
    y = body.let("bounded_degree", clamp(DEGREE, real(-MAX_DEGREE), real(MAX_DEGREE)))
    head, tail = _emit_log(body, double_words, constants)
    product, error = double_words.two_product("power", y, head)
    exp = constants.exp
    bounded = body.let("bounded_power", clamp(product, exp.lowest, exp.highest))
    is_inside = Compare("==", bounded, product)
    rest = body.let("rest", Select(is_inside, add(error, multiply(y, tail)), real(0.0)))
    value = append_exp(body, bounded, rest, exp)
    is_nought = Binary("and", Compare("<=", BASE, real(0.0)), Compare(">", DEGREE, real(0.0)))
    body.let("y", Select(is_nought, real(0.0), value))
    about = "base^degree; base >= 0, its power within that of exp, clamped; error < 0.95 ULP"
    return body.build("pow", about, ("base", "degree"))


def _emit_log(
    body: FunctionBuilder, double_words: _DoubleWordBuilder, constants: PowConstants
) -> tuple[Ref, Ref]:
    """Append log of the base and return it as (head, tail), whose sum is the logarithm.

    The largest relative error among 40 000 bases is 2^-63, in float32 2^-34 among 20 000 bases.
    """
    k, f = append_frexp(body, BASE, constants.log)
    first, *more = (Fraction(2, 2 * n + 3) for n in range(constants.terms))
    large, small = _split_constant(first, constants.number_type)
    s, s_rest = double_words.double_word_quotient("s", f)
    square, error = double_words.two_product("square", s, s)
    square_rest = add(error, multiply(multiply(real(2.0), s), s_rest))
    series = horner(tuple(round_to_type(c, constants.number_type) for c in more), square)
    higher = body.let("higher", multiply(square, series))
    factor = body.let("factor", add(large, higher))
    factor_rest = add(subtract(higher, subtract(factor, large)), small)
    cubic, error = double_words.two_product("cubic", square, factor)
    parts = add(multiply(square, factor_rest), multiply(square_rest, factor))
    cubic_rest = body.let("cubic_rest", add(error, parts))
    curved, error = double_words.two_product("curved", s, cubic)
    parts = add(multiply(s, cubic_rest), multiply(s_rest, cubic))
    curved_rest = body.let("curved_rest", add(error, parts))
    twice = body.let("twice", multiply(real(2.0), s))
    whole = body.let("whole", multiply(k, constants.log.ln_2[0]))
    sum_1, lost_1 = double_words.fast_two_sum("sum_1", whole, twice)
    sum_2, lost_2 = double_words.fast_two_sum("sum_2", sum_1, curved)
    small_parts = add(curved_rest, multiply(real(2.0), s_rest))
    low = add(add(lost_1, lost_2), add(small_parts, multiply(k, constants.log.ln_2[1])))
    return double_words.fast_two_sum("log", sum_2, body.let("low", low))


def _split_constant(value: Fraction, number_type: NumberType) -> tuple[Value, Value]:
    """Return a constant as the sum of two numbers of a type."""
    large = round_to_type(value, number_type)
    return real(large), real(round_to_type(value - Fraction(large), number_type))


class _DoubleWordBuilder:
    """Builder of sums, products and a quotient that come with their rounding errors."""

    def __init__(self, body: FunctionBuilder, splitter: float) -> None:
        self.body = body
        self.splitter = real(splitter)
        self.halves: dict[Ref, tuple[Ref, Ref]] = {}

    def fast_two_sum(self, name: str, larger: Expr, smaller: Expr) -> tuple[Ref, Ref]:
        """Append larger + smaller and its rounding error, and return both.

        It needs |larger| >= |smaller| or larger = 0 (Dekker 1971).
        """
        result = self.body.let(name, add(larger, smaller))
        return result, self.body.let(f"{name}_lost", subtract(smaller, subtract(result, larger)))

    def two_product(self, name: str, a: Ref, b: Ref) -> tuple[Ref, Ref]:
        """Append a b and its rounding error, and return both (Dekker 1971)."""
        (a_1, a_2), (b_1, b_2) = self._split(a), self._split(b)
        result = self.body.let(name, multiply(a, b))
        lost = add(subtract(multiply(a_1, b_1), result), multiply(a_1, b_2))
        lost = add(add(lost, multiply(a_2, b_1)), multiply(a_2, b_2))
        return result, self.body.let(f"{name}_lost", lost)

    def double_word_quotient(self, name: str, f: Ref) -> tuple[Ref, Ref]:
        """Append f / (2 + f) and its rounding error, and return both."""
        below, below_lost = self.fast_two_sum(f"{name}_below", real(2.0), f)
        result = self.body.let(name, divide(f, below))
        back, back_lost = self.two_product(f"{name}_back", result, below)
        left = subtract(subtract(subtract(f, back), back_lost), multiply(result, below_lost))
        return result, self.body.let(f"{name}_lost", divide(left, below))

    def _split(self, x: Ref) -> tuple[Ref, Ref]:
        """Return two numbers of half as many digits whose sum is x; each x is split once."""
        if x not in self.halves:
            name = x.name.partition(".")[2]
            wide = self.body.let(f"{name}_wide", multiply(self.splitter, x))
            high = self.body.let(f"{name}_high", subtract(wide, subtract(wide, x)))
            self.halves[x] = high, self.body.let(f"{name}_low", subtract(x, high))
        return self.halves[x]
