"""Slopes that are carried along a step show what it did; a tone is stepped finely."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from diagnosis.bench import Bench
from diagnosis.estimate import looked_at, outcome_at, with_normal
from diagnosis.layers import automaton, fewest_steps, fitting, shipped_effects
from diagnosis.normal import foreseen
from diagnosis.point import Point, point_of
from diagnosis.prediction import noises_of
from diagnosis.slopes import carried
from tests.diagnosis.test_estimation import TRUTH, bench, recorded

__all__ = ["bench"]


def test_carried_slopes_show_what_a_step_did(bench: Bench) -> None:
    candidate = bench.candidate(())
    series = recorded(candidate, TRUTH)
    here = looked_at(candidate, series, noises_of(series, {}), point_of(candidate, len(series), {}))
    here = with_normal(here, series)
    step = Point(
        np.full(len(candidate.names), 0.1), np.full((len(series), len(candidate.names)), 0.1)
    )
    there = Point(here.point.shared + step.shared, here.point.own + step.own)
    after = outcome_at(here, series, there)
    found = carried(candidate, here.columns, here.outcome, after, step)
    moved = np.sum([0.1 * found[name] for name in candidate.names], axis=0)
    known = np.isfinite(after.joined - here.outcome.joined)
    assert np.allclose(moved[known], (after.joined - here.outcome.joined)[known], atol=1e-9)
    still = here.normal
    assert still is not None
    assert foreseen(candidate, here.point, still, here.point) == pytest.approx(0.0)


@pytest.mark.parametrize(("period", "steps"), [(Fraction(1, 200), 5), (Fraction(1, 100), 10)])
def test_a_tone_at_an_input_is_stepped_by_a_millisecond(
    bench: Bench, period: Fraction, steps: int
) -> None:
    effect = next(one for one in shipped_effects() if one.name == "torque_ripple")
    layer = next(iter(fitting(bench.document, effect)))
    made = automaton(bench.document, bench.project, [layer])
    assert fewest_steps(made, [layer], bench.seen, period) == steps
    assert fewest_steps(bench.automaton, [], bench.seen, period) == 1


def test_a_drift_goes_with_a_delay_and_with_a_limited_rate(bench: Bench) -> None:
    known = {one.name: one for one in shipped_effects()}
    drift, *others = (
        next(one for one in fitting(bench.document, known[name]) if one.place == "T_em")
        for name in ("torque_drift", "actuator_delay", "torque_rate_limit")
    )
    for other in others:
        assert automaton(bench.document, bench.project, [drift, other]).parameters
