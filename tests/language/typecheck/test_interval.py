"""Intervals: every value lies in the interval of its expression; an `if` excludes values."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, strategies as st

from language.expressions.syntax_tree import SyntaxTree
from language.ir.ops import Ref
from language.lowering.expressions import lower_expression
from language.numerics.evaluate import evaluate
from language.typecheck.interval import UNBOUNDED, Interval, inverse_power
from language.typecheck.range_analysis import RangeAnalysis
from tests.language.spec_builders import tree

RANGES = {"a": Interval(-2.0, 3.0, True), "b": Interval(0.5, 4.0, True)}
TEXTS = [
    *("a + b", "a - b", "a * b", "a / b", "-a * a", "a^3 - b^2", "b^-2", "abs(a) - b", "max(a, b)"),
    *("min(a, 1)", "clip(a, -1, 1)", "sqrt(b) * a", "exp(a)", "tanh(a) + sin(b)", "floor(a)"),
    *("pow(b, a)", "pow(abs(a), 1.5) - b", "pow(b, 0.5)"),
    *("log(b)", "log(a * a + 0.5) - b"),
    *("if a > 1 then a else b", "if abs(a) > 1 then 1 / a else 0", "sign(a) * b", "atan2(a, b)"),
    *("if not (a <= 1) and b < 2 then a - b else 0", "b / (a * a + 1)", "clip(a, b, 5)"),
]


def ranged(text: str) -> tuple[Interval, list[str]]:
    """Return the interval of a text and what is reported in it."""
    found: list[str] = []

    def report(what: str, part: SyntaxTree, interval: Interval) -> None:
        if interval.is_certain:
            found.append(f"{what} {part.span.column}")

    ranging = RangeAnalysis(
        lambda name: RANGES.get(name, UNBOUNDED), lambda name: UNBOUNDED, report
    )
    return ranging.analyse(tree(text)), found


@pytest.mark.parametrize("text", TEXTS)
@given(st.floats(-2.0, 3.0), st.floats(0.5, 4.0))
def test_every_value_lies_in_the_interval(text: str, a: float, b: float) -> None:
    interval, reported = ranged(text)
    assert reported == []
    value = evaluate(lower_expression(tree(text), {"a": Ref("a"), "b": Ref("b")}), {"a": a, "b": b})
    slack = 1e-9 * max(1.0, abs(float(value)))
    assert interval.low - slack <= value <= interval.high + slack


EXTREMES = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False),
    st.sampled_from([0.0, 5e-324, 1e-310, 1e-200, 1e-50, 1.0, 1e50, 1e200, 1.7e308]).flatmap(
        lambda size: st.sampled_from([size, -size])
    ),
)


@given(st.lists(EXTREMES, min_size=3, max_size=3), EXTREMES, st.integers(-8, 8), st.booleans())
def test_extreme_bounds_hold_every_value(
    numbers: list[float], other: float, exponent: int, is_certain: bool
) -> None:
    """Also where a power or a quotient is too large or too small for a double."""
    low, a, high = sorted(numbers)
    ranges = {"a": Interval(low, high, is_certain), "b": Interval(other, other, is_certain)}
    power = f"a^{exponent}" if exponent else "a"
    for text in (power, f"b / {power}", f"{power} / a", f"b * {power}", f"b - {power} + a"):
        analysis = RangeAnalysis(ranges.__getitem__, lambda name: UNBOUNDED)
        interval = analysis.analyse(tree(text))
        lowered = lower_expression(tree(text), {"a": Ref("a"), "b": Ref("b")})
        value = float(evaluate(lowered, {"a": a, "b": other}))
        slack = max(5e-324, 1e-9 * abs(value)) if math.isfinite(value) else 0.0
        assert not math.isnan(interval.low) and not math.isnan(interval.high)
        if not math.isnan(value):
            assert interval.low - slack <= value <= interval.high + slack, (text, interval, value)


def test_a_power_that_underflows_gives_no_bound() -> None:
    found = inverse_power(Interval(1e-50, 1.0, True), 8)
    assert (found.low, found.high, found.is_certain) == (1.0, math.inf, True)
    found = inverse_power(Interval(-1.0, -1e-200, True), 3)
    assert (found.low, found.high) == (-math.inf, -1.0)


def test_a_divisor_without_values_that_ends_at_zero_gives_no_bound() -> None:
    """Where a condition is never true, the lower bound is above the upper one."""
    ranges = {"a": Interval(-5.0, 0.0, True)}
    analysis = RangeAnalysis(ranges.__getitem__, lambda name: UNBOUNDED)
    assert analysis.analyse(tree("if a > 3 then 1 / a else 2")).high >= 2.0
    assert analysis.analyse(tree("if a > 3 then a^-3 else 2")).high >= 2.0


@pytest.mark.parametrize(
    ("text", "low", "high"),
    [
        ("a + b", -1.5, 7.0),
        ("a * b", -8.0, 12.0),
        ("a^2", 0.0, 9.0),
        ("a * a", 0.0, 9.0),
        ("abs(a)", 0.0, 3.0),
        ("1 / b", 0.25, 2.0),
        ("pow(b, 2)", 0.25, 16.0),
        ("pow(abs(a), 3)", 0.0, 27.0),
        ("max(a, 1)", 1.0, 3.0),
        ("max(c, 1)", 1.0, math.inf),
        ("c^2", 0.0, math.inf),
    ],
)
def test_bounds_are_as_narrow_as_the_operations_give(text: str, low: float, high: float) -> None:
    interval, _ = ranged(text)
    assert (interval.low, interval.high) == (low, high)


@pytest.mark.parametrize(
    ("text", "reported"),
    [
        ("b / a", ["divisor 5"]),
        ("b / (a + 2)", ["divisor 6"]),
        ("a^-1", ["divisor 1"]),
        ("sqrt(a)", ["root 6"]),
        ("pow(a, 2)", ["power 5"]),
        ("pow(b - 0.5, 2)", []),
        ("pow(b - 0.5, a)", ["inverse power 5"]),
        ("1 / (16 - pow(b, 2))", ["divisor 6"]),
        ("sqrt(max(a, 0))", []),
        ("if a > 0 then b / a else 0", []),
        ("if a >= 0 then b / a else 0", ["divisor 20"]),
        ("if a > 0 or b > 1 then b / a else 0", ["divisor 28"]),
        ("if a <= 0 or b > 1 then 0 else b / a", []),
        ("if not (a > 0) then 0 else sqrt(a)", []),
        ("if abs(a) > 0 then b / a else 0", []),
        ("if 0 < a then sqrt(a) else sqrt(-a)", []),
        ("b / c + sqrt(c)", []),
        ("b / (a * c)", []),
    ],
)
def test_only_what_declared_ranges_allow_is_reported(text: str, reported: list[str]) -> None:
    assert ranged(text)[1] == reported
