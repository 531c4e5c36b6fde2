"""How innovations change with a coordinate, be it the order of a tone that runs for a long time."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.bench import Bench
from diagnosis.estimate import innovations_at, looked_at, outcome_at
from diagnosis.estimation import estimated
from diagnosis.layers import fitting, shipped_effects
from diagnosis.normal import Normal, stepped
from diagnosis.point import Point, point_of
from diagnosis.prediction import noises_of
from diagnosis.slopes import STEP, columns_of
from tests.diagnosis.test_estimation import TRUTH, bench, recorded

__all__ = ["bench"]
TONE = {"a_T_em": 6.0, "ord_T_em": 4.0, "ph_T_em": 0.5}


@pytest.mark.parametrize("name", ["ord_T_em", "a_T_em", "J_em"])
def test_a_column_is_the_slope_at_its_point(bench: Bench, name: str) -> None:
    effect = next(one for one in shipped_effects() if one.name == "torque_ripple")
    candidate = bench.candidate((next(iter(fitting(bench.document, effect))),))
    series = recorded(candidate, {**TRUTH, **TONE})
    point = point_of(candidate, len(series), {**TRUTH, **TONE})
    here = looked_at(candidate, series, noises_of(series, {}), point)
    found = columns_of(
        candidate, point, here.outcome, lambda points: innovations_at(here, series, points), [name]
    )[name]
    tiny, k = 1e-6, candidate.names.index(name)
    ahead, behind = (outcome_at(here, series, point.moved(candidate, k, s)) for s in (tiny, -tiny))
    apart = point.moved(candidate, k, tiny).shared[k] - point.moved(candidate, k, -tiny).shared[k]
    slope = (ahead.joined - behind.joined) / apart
    assert np.nanmax(np.abs(found - slope)) < 0.25 * np.nanmax(np.abs(slope))
    assert tiny < STEP


def test_the_strength_of_a_tone_is_found_from_where_its_order_is_right(bench: Bench) -> None:
    effect = next(one for one in shipped_effects() if one.name == "torque_ripple")
    candidate = bench.candidate((next(iter(fitting(bench.document, effect))),))
    series = recorded(candidate, {**TRUTH, **TONE})
    start = {**TRUTH, **TONE, "a_T_em": 1.0}
    found = estimated(candidate, series, noises_of(series, {}), start)
    assert found.values(0)["a_T_em"] == pytest.approx(TONE["a_T_em"], rel=0.1)


def test_a_step_is_found_where_changes_drown_the_priors(bench: Bench) -> None:
    candidate = bench.candidate(())
    count = len(candidate.names)
    point = Point(np.zeros(count), np.zeros((1, count)))
    normal = Normal(
        np.full((1, count, count), 1e180),
        np.full((1, count), 1e90),
        np.zeros(count, dtype=bool),
        np.zeros(1, dtype=np.int64),
        np.zeros(1, dtype=np.int64),
    )
    assert np.all(np.isfinite(stepped(candidate, point, normal, 0.0).shared))
