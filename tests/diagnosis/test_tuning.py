"""Levels of noises and parameters are found together, whatever levels a fit begins with."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from diagnosis.bench import Bench
from diagnosis.candidate import Candidate
from diagnosis.estimate import Estimate, looked_at
from diagnosis.estimation import followed
from diagnosis.level import settled, units_of
from diagnosis.point import Point
from diagnosis.prediction import DRIFTS, INPUTS, SIGNAL, Noises, noises_at, noises_of
from diagnosis.series import Series
from diagnosis.tuning import FARTHEST, LEAST, MOST, tuned
from diagnosis.uncertain import Uncertain
from tests.diagnosis.test_estimation import FRICTION, TRUTH, bench, recorded

__all__ = ["bench"]
NEAR = 3.0
"""Nats by which fits from different levels may differ."""
LEVELS, FACTORS = (0.1, 1.0), (0.6, 1.0, 1.8)
"""Levels of drifts in their units, and factors of the noise of signals, that fits begin with."""


@pytest.fixture(scope="module")
def rubbing(bench: Bench) -> tuple[Series, ...]:
    """Return recordings of a driveline with a friction that the base lacks."""
    layers = [layer for layer in bench.layers() if layer.id == "coulomb_friction@w_em"]
    return recorded(bench.candidate(layers), {**TRUTH, **FRICTION})


def begun(base: Candidate, series: tuple[Series, ...], level: float, factor: float) -> Estimate:
    """Return the base fitted with levels that stay as they are given."""
    units = units_of(base, series, {})
    known = noises_of(series, {name: level * unit for name, unit in units.items()})
    return followed(base, series, dataclasses.replace(known, seen=factor * known.seen), {})


def test_fits_that_begin_with_other_levels_end_as_good(
    bench: Bench, rubbing: tuple[Series, ...]
) -> None:
    base = bench.candidate(())
    units = units_of(base, rubbing, {})
    starts = [begun(base, rubbing, level, factor) for level in LEVELS for factor in FACTORS]
    ends = [settled(base, rubbing, one.noises, {}, units).cost for one in starts]
    assert max(ends) - min(ends) < NEAR
    costs = [one.cost for one in starts]
    assert max(costs) - min(costs) > 10 * NEAR, "they would have been as good without"


def test_levels_stay_near_what_is_known_of_them(bench: Bench, rubbing: tuple[Series, ...]) -> None:
    base = bench.candidate(())
    units, known = units_of(base, rubbing, {}), noises_of(rubbing, {})
    found = tuned(begun(base, rubbing, 1.0, 1.0), rubbing, units)
    for name, unit in units.items():
        assert LEAST * unit <= found.noises.drifts[name] * (1 + 1e-9)
        assert found.noises.drifts[name] <= MOST * unit * (1 + 1e-9)
    ratios = found.noises.seen / known.seen
    assert np.all(ratios <= FARTHEST * (1 + 1e-9))
    assert np.all(ratios >= (1 - 1e-9) / FARTHEST)


def test_a_tuned_fit_is_one_of_the_same_candidate(
    bench: Bench, rubbing: tuple[Series, ...]
) -> None:
    base = bench.candidate(())
    found = tuned(begun(base, rubbing, 0.1, 1.0), rubbing, units_of(base, rubbing, {}))
    assert found.candidate is base
    assert found.point.shared.shape == (len(base.names),)
    assert found.cost == found.outcome.cost() + found.point.prior(base)
    assert found.normal is not None
    assert found.normal.a.shape[1:] == (len(base.names), len(base.names))
    assert set(found.columns) == set(base.names)
    again = looked_at(base, rubbing, found.noises, found.point, found.outcome)
    assert again.cost == pytest.approx(found.cost, abs=NEAR)


def test_what_feeds_nothing_back_keeps_its_noises(
    bench: Bench, rubbing: tuple[Series, ...]
) -> None:
    base = bench.candidate(())
    given = begun(base, rubbing, 0.1, 1.0).noises
    alone = followed(base, rubbing, dataclasses.replace(given, drifts={}, is_alone=True), {})
    assert tuned(alone, rubbing, {}).noises is alone.noises


def test_noises_follow_the_coordinates_of_their_levels(bench: Bench) -> None:
    base = bench.candidate(())
    drift, signal = base.drifts[0], base.predictor.seen[1]
    names = (DRIFTS.format(drift), SIGNAL.format(signal), INPUTS)
    levels = tuple(Uncertain(name, 2.0, 0.1, 50.0, 1.0, True) for name in names)
    wide = dataclasses.replace(base, levels=levels)
    z = np.zeros(len(wide.names))
    z[-3:] = np.log([1.5, 2.5, 0.5])
    blank = Noises(np.array([7.0, 8.0]), np.array([1.0, 4.0]), {drift: 9.0}, np.ones(2))
    found = noises_at(wide, Point(z, z[None]), blank)
    assert found.drifts == {drift: pytest.approx(3.0)}
    assert list(found.seen) == [7.0, pytest.approx(5.0)]
    assert list(found.inputs) == [pytest.approx(0.25), pytest.approx(1.0)]
    assert noises_at(base, Point(z[:-3], z[None, :-3]), blank) is blank
