"""Dimension: what an expression is, and what does not fit; angles are in test_angle.py."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given, strategies as st

from language.expressions.syntax_tree import (
    Arithmetic,
    Conditional,
    FunctionCall,
    Name,
    Negation,
    Power,
    Relation,
    SyntaxTree,
)
from language.expressions.units import Dimension
from language.ir.ops import Expr, Value
from language.lowering.expressions import lower_expression
from language.numerics.evaluate import evaluate
from language.text.diagnostic import Problems
from language.typecheck.infer import TypeChecker
from language.typecheck.name_environment import NameEnvironment
from language.typecheck.types import ExprType
from tests.language.spec_builders import NOWHERE, automaton, dimension, problem_lines, tree

UNITS = {"x": "m", "v": "m/s", "m": "kg", "F": "N", "t": "s", "c": "1", "i": "A", "Tk": "K"}
NAMES: dict[str, ExprType] = {name: dimension(unit) for name, unit in UNITS.items()}
SCOPE = NameEnvironment(
    {**NAMES, "flag": "truth", "broken": None}, frozenset({"plant.on"}), "in a test"
)


def checked(text: str) -> tuple[ExprType | None, list[str]]:
    problems = Problems()
    kind = TypeChecker(SCOPE, problems).infer_type(tree(text))
    return kind, [f"{problem.span.column} {problem.label}" for problem in problems.reported]


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("m * v / t", "N"),
        ("F * x", "J"),
        ("m * v^2", "J"),
        ("sqrt(F * x / m)", "m/s"),
        ("x^-1", "1/m"),
        ("1 / t", "1/s"),
        ("abs(-v)", "m/s"),
        ("min(x, 3 mm)", "m"),
        ("clip(x, 0, 1 m)", "m"),
        ("clip(x, -1 m, 1 m)", "m"),
        ("sign(v)", "1"),
        ("tanh(c)", "1"),
        ("exp(x / (v * t))", "1"),
        ("log(x / (v * t))", "1"),
        ("if flag then x else v * t", "m"),
        ("if flag then 0 else x", "m"),
        ("3", "1"),
        ("3 km/h", "m/s"),
        ("0 + x", "m"),
    ],
)
def test_an_expression_has_a_dimension(text: str, unit: str) -> None:
    kind, found = checked(text)
    assert found == []
    assert isinstance(kind, Dimension)
    assert kind.powers == dimension(unit).powers


@pytest.mark.parametrize(
    "text",
    ["x > 0", "x < v * t", "flag", "true", "not flag", "flag and x > 0", "in(plant.on) or flag"],
)
def test_an_expression_is_true_or_false(text: str) -> None:
    assert checked(text) == ("truth", [])


@pytest.mark.parametrize(
    ("text", "label"),
    [
        ("F + v", "1 `+` joins `N` and `m/s`"),
        ("c + x - F", "1 `+` joins `1` and `m`"),
        ("x > t", "1 `>` joins `m` and `s`"),
        ("max(x, t)", "1 `max` joins `m` and `s`"),
        ("if flag then x else t", "4 `if` joins `m` and `s`"),
        ("sqrt(x)", "1 `m` has no square root"),
        ("exp(x)", "1 `exp` takes a number, this is in `m`"),
        ("x + flag", "5 this is true or false, a quantity is needed"),
        ("flag > 0", "1 this is true or false, a quantity is needed"),
        ("not x", "5 `not` is a condition, this is a quantity"),
        ("flag and x", "10 `and` is a condition, this is a quantity"),
        ("if x then 1 else 2", "4 `if` is a condition, this is a quantity"),
        ("if flag then x else flag", "4 one alternative is a condition, the other a quantity"),
        ("c == 1", "1 `==` is not for real numbers"),
        ("c != 1", "1 `!=` is not for real numbers"),
        ("max(x)", "1 `max` takes 2 argument(s), not 1"),
        ("clip(x, x)", "1 `clip` takes 3 argument(s), not 2"),
        ("foo(x)", "1 `foo` is not a function that can be used here"),
        ("x + y", "5 `y` is not known in a test"),
        (
            "in(plant.off)",
            "1 `in(plant.off)` does not name a mode of the run of this mode or of a region",
        ),
        ("in(x > 0)", "1 `in(...)` does not name a mode of the run of this mode or of a region"),
    ],
)
def test_what_does_not_fit_is_told_once(text: str, label: str) -> None:
    assert checked(text)[1] == [label]


def test_mistakes_side_by_side_are_all_told() -> None:
    assert checked("(F + v) * (x + t) + max(y1, z1)")[1] == [
        "2 `+` joins `N` and `m/s`",
        "12 `+` joins `m` and `s`",
        "25 `y1` is not known in a test",
        "29 `z1` is not known in a test",
    ]


def test_a_mistake_that_was_told_is_not_told_again_further_out() -> None:
    assert checked("broken + x > 3 s")[1] == []
    assert checked("sqrt(F + v) + 3 kg > flag")[1] == [
        "6 `+` joins `N` and `m/s`",
        "22 this is true or false, a quantity is needed",
    ]


def test_the_nearest_name_is_proposed() -> None:
    problems = Problems()
    check = TypeChecker(NameEnvironment({"theta_d": dimension("rad")}), problems)
    check.infer_type(tree("theta_D + mex(theta_d, 0)"))
    hints = [problem.help for problem in problems.reported]
    assert hints == ["did you mean `theta_d`?", "did you mean `max`?"]


def test_all_arguments_fit_each_other_behind_a_bare_0() -> None:
    assert checked("clip(0, 1 m, 2 s)")[1]


def test_two_truth_values_may_be_compared() -> None:
    assert checked("flag == (x > 0)") == ("truth", [])


# What an expression is worth grows with its dimension when the base units shrink.

POWERS = (2.0, 3.0, 5.0, 7.0, 11.0)
"""How many new base units one m, kg, s, A, K is."""
VALUES = {name: 0.6 + 0.35 * place for place, name in enumerate(UNITS)}


def larger(kind: ExprType | None) -> float:
    assert isinstance(kind, Dimension)
    return math.prod(p**k for p, k in zip(POWERS, kind.powers, strict=True))


def composed(parts: st.SearchStrategy[SyntaxTree]) -> st.SearchStrategy[SyntaxTree]:
    at = st.just(NOWHERE)
    some = st.one_of(parts, parts.map(lambda x: Arithmetic("*", x, x, NOWHERE)))
    pair = st.one_of(parts.map(lambda x: (x, x)), st.tuples(some, parts)).map(tuple)
    condition = st.builds(Relation, st.sampled_from(["<", ">="]), parts, parts, at)
    return st.one_of(
        st.builds(Arithmetic, st.sampled_from(["*", "/"]), parts, parts, at),
        st.builds(Arithmetic, st.sampled_from(["+", "-"]), parts, parts, at),
        st.builds(Negation, parts, at),
        st.builds(Power, parts, st.integers(-3, 3), at),
        st.builds(FunctionCall, st.sampled_from(["min", "max"]), pair, at),
        st.builds(lambda x: FunctionCall("abs", (x,), NOWHERE), parts),
        st.builds(lambda x: FunctionCall("sqrt", (x,), NOWHERE), some),
        st.builds(Conditional, condition, parts, parts, at),
    )


quantities = st.recursive(
    st.builds(Name, st.sampled_from(sorted(UNITS)), st.just(NOWHERE)), composed, max_leaves=5
)


def worth(part: SyntaxTree, factors: dict[str, float]) -> float:
    known: dict[str, Expr] = {n: Value(VALUES[n] * factors[n]) for n in UNITS}
    return float(evaluate(lower_expression(part, known), {}))


@given(quantities)
def test_an_accepted_expression_scales_as_its_dimension_says(part: SyntaxTree) -> None:
    problems = Problems()
    kind = TypeChecker(NameEnvironment(NAMES), problems).infer_type(part)
    assume(not problems.has_errors)
    before = worth(part, dict.fromkeys(UNITS, 1.0))
    after = worth(part, {name: larger(NAMES[name]) for name in UNITS})
    assume(math.isfinite(before) and math.isfinite(after) and abs(before) > 1e-6)
    assert math.isclose(after, before * larger(kind), rel_tol=1e-9)


# In an automaton.

FALL = """language: 1
automaton: fall
parameters: {{m: {{value: 2 kg}}, g: {{value: 9.81 m/s^2}}}}
states: {{z: {{unit: m, initial: 1 m}}, v: {{unit: m/s, initial: 0 m/s}}}}
equations: {{{equations}}}
flow: {{z: der(z) = v, v: "{balance}"}}
initial: up
modes:
  up: {{equations: {{{up}}}, transitions: {{down: {{when: v < 0 m/s}}}}}}
  down: {{equations: {{{down}}}}}
"""


def fall(
    equations: str = "", balance: str = "der(v) = -g", up: str = "", down: str = ""
) -> list[str]:
    text = FALL.format(equations=equations, balance=balance, up=up, down=down)
    return [line.partition(" ")[2] for line in problem_lines(lambda: automaton(text))]


@pytest.mark.parametrize("balance", ["m * der(v) = -m * g", "der(v) * m = -m * g", "der(v) = 0"])
def test_a_balance_fits_its_left_side(balance: str) -> None:
    assert fall(balance=balance) == []


@pytest.mark.parametrize(
    ("balance", "label"),
    [
        ("m * der(v) = -g", "this is in `m/s^2`, `the left side for v` is in `N`"),
        ("der(v) = v", "this is in `m/s`, `the left side for v` is in `m/s^2`"),
        ("der(z) = -g", "the left side is `coefficient * der(v)` with der once"),
        ("der(v) * der(v) = g", "the left side is `coefficient * der(v)` with der once"),
        ("m + der(v) = g", "the left side is `coefficient * der(v)` with der once"),
        ("der(v) = der(z)", "`der` is not a function that can be used here"),
    ],
)
def test_a_balance_that_does_not_fit_is_refused(balance: str, label: str) -> None:
    assert label in fall(balance=balance)


def test_a_name_is_the_same_thing_in_every_mode() -> None:
    assert fall(up="e: v", down="e: 0") == []
    assert fall(up="e: v", down="e: z * 1 1/s") == []
    assert fall(up="e: v", down="e: z") == ["`e` is in `m` here and in `m/s` in another mode"]
    assert fall(up="e: v > 0", down="e: v") == [
        "`e` is in `m/s` here and in `truth` in another mode"
    ]


FREE = (
    "check._agreed: where the first mode's value is free in the angle (a product), its dimension "
)


def test_a_product_is_the_same_thing_in_every_mode() -> None:
    assert fall(up="e: m * v", down="e: m * z") == [
        "`e` is in `m*kg` here and in `m*kg/s` in another mode"
    ]


def test_a_product_keeps_its_dimension_beside_a_bare_0() -> None:
    text = FALL.format(equations="", balance="der(v) = -g", up="e: m * v", down="e: 0")
    assert automaton(text).dimensions["e"].powers == dimension("kg*m/s").powers


def test_a_bare_0_goes_with_what_the_name_is_in_a_later_mode() -> None:
    assert fall(up="e: 0", down="e: m * v") == []


def test_a_long_sum_is_read_or_refused_but_never_a_crash() -> None:
    told = [fall(equations="e: " + "+".join("z" * count)) for count in range(40, 480, 20)]
    assert told[0] == []
    assert told[-1] == ["the expression is nested too deeply"]
    assert all(one in (told[0], told[-1]) for one in told)
