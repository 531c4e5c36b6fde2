"""The nested form of an effect, against fits in which the parameters are fixed."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, strategies as st

from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.normal_equations import NormalEquations
from diagnosis.model.parameter import FreeParameter
from diagnosis.model.parameter_vector import ParameterVector
from diagnosis.selection.nested_form import GENERAL_FORM, choose_form

NAMES = ("a", "b", "c")


def fitted(information: np.ndarray, point: np.ndarray, plain: dict[str, float]) -> Estimate:
    """A fit at the minimum of a quadratic cost; coordinates are values."""
    free = tuple(
        FreeParameter(name, 0.0, -99.0, 99.0, 1.0, False, plain=plain.get(name)) for name in NAMES
    )
    candidate = SimpleNamespace(names=NAMES, free_parameters=free)
    normal = NormalEquations(
        (information - np.eye(3))[None], np.zeros((1, 3)), np.zeros(3, dtype=bool)
    )
    vector = ParameterVector(point, np.zeros((1, 3)))
    blank: Any = None
    return Estimate(cast(Any, candidate), vector, 0.0, blank, blank, blank, normal)


def cost_with_fixed(information: np.ndarray, point: np.ndarray, fixed: dict[int, float]) -> float:
    """The least increase of the quadratic cost if coordinates have given values."""
    held = sorted(fixed)
    free = [k for k in range(3) if k not in fixed]
    step = np.zeros(3)
    step[held] = [fixed[k] - point[k] for k in held]
    if free:
        among = np.ix_(free, free)
        step[free] = -np.linalg.solve(
            information[among], information[np.ix_(free, held)] @ step[held]
        )
    return float(0.5 * step @ information @ step)


numbers = st.floats(-3.0, 3.0, allow_subnormal=False)


@given(st.lists(numbers, min_size=9, max_size=9), st.lists(numbers, min_size=3, max_size=3))
def test_the_added_cost_is_that_of_a_fit_with_fixed_parameters(
    root: list[float], point: list[float]
) -> None:
    half = np.array(root).reshape(3, 3)
    information, where = half @ half.T + np.eye(3), np.array(point)
    form = choose_form(fitted(information, where, {"b": 0.0, "c": 1.0}), 1.0, 2.0)
    values = {"b": 0.0, "c": 1.0}
    fixed = {NAMES.index(name): values[name] for name in form.fixed}
    assert form.added_cost == pytest.approx(cost_with_fixed(information, where, fixed), abs=1e-9)
    assert form.added_cost <= 2.0 * len(form.fixed)
    for name in set(values) - set(form.fixed):
        more = {**fixed, NAMES.index(name): values[name]}
        assert cost_with_fixed(information, where, more) >= form.added_cost + 2.0 - 1e-9


def test_a_parameter_that_differs_from_its_plain_value_is_kept() -> None:
    information = np.diag([100.0, 100.0, 100.0])
    model = fitted(information, np.array([1.0, 0.9, 0.01]), {"b": 0.0, "c": 0.0})
    assert choose_form(model, 1.0, 3.0).fixed == ("c",)
    assert choose_form(model, 50.0, 3.0).fixed == ("c", "b")
    general = fitted(information, np.array([1.0, 0.9, 0.01]), {})
    assert choose_form(general, 1.0, 3.0) == GENERAL_FORM
    unknown = dataclasses.replace(model, normal_equations=None)
    assert choose_form(unknown, 1.0, 3.0) == GENERAL_FORM
