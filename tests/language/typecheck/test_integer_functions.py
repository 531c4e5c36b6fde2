"""Whole numbers: what functions make of them, with all values of small ranges."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import pytest

from language.expressions.units import PURE_NUMBER
from language.ir.ops import Ref
from language.lowering.expressions import lower_expression
from language.numerics.evaluate import evaluate
from language.text.diagnostic import Problems
from language.typecheck.infer import TypeChecker
from language.typecheck.name_environment import NameEnvironment
from language.typecheck.types import IntType
from tests.language.spec_builders import tree

RANGES = {"i": IntType(-3, 2), "j": IntType(1, 4), "k": IntType(-1, 5)}
FUNCTIONS: dict[str, Callable[[int, int, int], int]] = {
    "abs(i)": lambda i, j, k: abs(i),
    "abs(j)": lambda i, j, k: abs(j),
    "min(i, j)": lambda i, j, k: min(i, j),
    "max(i, 0)": lambda i, j, k: max(i, 0),
    "min(j + 1, 4)": lambda i, j, k: min(j + 1, 4),
    "clip(k, 0, 3)": lambda i, j, k: min(max(k, 0), 3),
    "clip(k, i, j)": lambda i, j, k: min(k, j) if k > i else i,
    "clip(j, k, -2)": lambda i, j, k: min(j, -2) if j > k else k,
}


@pytest.mark.parametrize("text", FUNCTIONS)
def test_a_function_of_whole_numbers_is_whole_with_the_range_of_its_values(text: str) -> None:
    check = TypeChecker(NameEnvironment(dict(RANGES)), Problems())
    written = lower_expression(tree(text), {name: Ref(f"discrete.{name}", True) for name in RANGES})
    values = []
    for point in itertools.product(*(range(w.low, w.high + 1) for w in RANGES.values())):
        at = {f"discrete.{name}": value for name, value in zip(RANGES, point, strict=True)}
        values.append(FUNCTIONS[text](*point))
        found = evaluate(written, at)
        assert (found, type(found)) == (values[-1], int)
    assert check.infer_type(tree(text)) == IntType(min(values), max(values))


def test_beside_a_real_they_are_reals() -> None:
    check = TypeChecker(NameEnvironment(dict(RANGES)), Problems())
    assert (
        check.infer_type(tree("min(j, 2.5)"))
        == check.infer_type(tree("max(j / 2, k)"))
        == PURE_NUMBER
    )
    assert check.problems.reported == []


def test_few_stand_inside_each_other_for_each_holds_copies() -> None:
    check = TypeChecker(NameEnvironment(dict(RANGES)), Problems())
    assert check.infer_type(tree("min(abs(max(abs(k), 1)), 4)")) == IntType(1, 4)
    assert check.infer_type(tree("abs(min(abs(max(abs(k), 1)), 4))")) is None
    (problem,) = check.problems.reported
    assert problem.label == "`abs` of whole numbers is nested too deeply"
