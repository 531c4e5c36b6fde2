"""Questions over the reals: each answer against values that are tried, or known by hand."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given, strategies as st

from language.ir.ops import Expr, Ref
from language.lowering.expressions import lower_expression
from language.smt.bound_propagation import is_disproved_by_bounds
from language.smt.query import SolverQuery, VariableDomain
from language.smt.z3_backend import Solver
from tests.language.spec_builders import tree

SOLVER = Solver()
EXTENTS = {
    "x": VariableDomain(low=Fraction(-4), high=Fraction(4)),
    "y": VariableDomain(),
    "n": VariableDomain("whole", low=Fraction(0), high=Fraction(9)),
    "p": VariableDomain("truth"),
    "key": VariableDomain("whole", numbers=(0, 1, 2), names=("parked", "on_road", "open")),
}
KNOWN: dict[str, Expr] = {
    name: Ref(name, extent.type == "whole") for name, extent in EXTENTS.items()
}


def question(*texts: str) -> SolverQuery:
    conditions = tuple(lower_expression(tree(text), KNOWN) for text in texts)
    return SolverQuery(conditions, (), EXTENTS, {})


NEVER = [
    ("x > 4",),
    ("x * x < 0",),
    ("x * x + y * y < 2 * x * y",),
    ("x > 1", "y > x", "y < 1"),
    ("abs(x) < 1", "x > 1 or x < -1"),
    ("min(x, y) > max(x, y)",),
    ("clip(x, 0, 1) > 1",),
    ("sqrt(y) < 0",),
    ("sqrt(y) > 3", "y < 9", "y >= 0"),
    ("floor(x) > x",),
    ("sign(x) > 0", "x <= 0"),
    ("sin(x) > 1",),
    ("exp(y) < 0",),
    ("sin(x) > sin(y)", "x <= y", "x >= y"),
    ("n < 0",),
    ("n > 3", "n < 4"),
    ("p", "not p"),
    ("not (p or x > 0)", "p"),
    ("(if x > 0 then x else -x) < 0",),
    ("x / 2 > 2.5",),
]


@pytest.mark.parametrize("texts", NEVER)
def test_what_can_never_be_is_proven(texts: tuple[str, ...]) -> None:
    assert SOLVER.solve(question(*texts)) == "never"


SOMETIMES = [
    ("x * x > 15", "x < 0"),
    ("y * y * y > 8", "y < 2.01"),
    ("x * y > 1", "x + y < -3"),
    ("n > 3", "n < 5", "p"),
    ("sqrt(y) > 3", "y < 9.1", "y > 0"),
    ("floor(x) < x - 0.9",),
    ("x >= 0.1", "x <= 0.1"),
]


@pytest.mark.parametrize("texts", SOMETIMES)
def test_what_is_found_holds_by_our_own_arithmetic(texts: tuple[str, ...]) -> None:
    asked = question(*texts)
    found = SOLVER.solve(asked)
    assert not isinstance(found, str)
    assert asked.holds_at(found)


def test_threads_ask_side_by_side() -> None:
    """z3 gives terms of other sorts, or ends the process, where two threads are in its context."""
    together = Solver()
    many = [*NEVER, *SOMETIMES] * 20
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda texts: together.solve(question(*texts)), many))
    proven = [found == "never" for found in answers]
    assert proven == [texts in NEVER for texts in many]
    assert "open" not in answers


def test_functions_without_a_theory_are_any_within_their_bounds() -> None:
    """z3 takes sin(0.5) for 0.9, so its witness is none by our arithmetic."""
    asked = question("sin(x) > 0.9", "x < 1", "x > 0")
    found = SOLVER.solve(asked)
    assert not isinstance(found, str)
    assert not asked.holds_at(found)


def test_a_point_outside_of_the_extents_is_no_witness() -> None:
    assert not question("x > 1").holds_at({"x": 5.0})
    assert not question("key > -1").holds_at({"key": 3})
    assert question("x > 1").holds_at({"x": 4.0})


@pytest.mark.parametrize(
    "texts",
    [
        ("x > 4",),
        ("x > 1", "x < 1"),
        ("x >= 1", "x < 1"),
        ("2 * x - y > 1", "y >= 2 * x"),
        ("x + y > 1 and p", "-y >= x"),
        ("not (x < 2 or p)", "x / 2 <= 0.75"),
        ("x + n > 13",),
        ("x > 1", "y > x", "y < 1"),
        ("y - x > 0", "x - 2 * y > 0", "y >= 0"),
        ("p", "x > 0 and not p"),
    ],
)
def test_linear_conditions_are_disproved_without_a_solver(texts: tuple[str, ...]) -> None:
    assert is_disproved_by_bounds(question(*texts))


sides = st.sampled_from(["x", "y", "x + y", "2 * x - y", "-x", "0.5", "x * y", "n"])
relations = st.builds(
    "{} {} {}".format, sides, st.sampled_from(["<", "<=", ">", ">="]), st.sampled_from("01xy")
)
conditions = st.one_of(
    relations,
    relations.map("not ({})".format),
    st.builds("({}) and ({})".format, relations, relations),
    st.builds("not (({}) or ({}))".format, relations, relations),
)
reals = st.sampled_from([-4.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0])


@given(st.lists(conditions, min_size=1, max_size=4), reals, reals, st.integers(0, 3))
def test_what_is_disproved_never_holds(texts: list[str], x: float, y: float, n: int) -> None:
    asked = question(*texts)
    point: dict[str, Any] = {"x": x, "y": y, "n": n}
    if asked.holds_at(point):
        assert not is_disproved_by_bounds(asked)
        assert SOLVER.solve(asked) != "never"
