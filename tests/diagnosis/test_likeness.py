"""A candidate has its modes where a model near it was seen to have them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from diagnosis.bench import Bench
from diagnosis.estimate import Estimate, looked_at, looked_like
from diagnosis.likeness import seen_like
from diagnosis.point import extended
from diagnosis.series import Series
from tests.diagnosis.test_estimation import FRICTION, TRUTH, bench, recorded
from tests.diagnosis.test_location import based

__all__ = ["bench"]
Pair = tuple[tuple[Series, ...], Estimate, Estimate]


@pytest.fixture(scope="module")
def pair(bench: Bench) -> Pair:
    """Return recordings with the base fitted to them, and a candidate as it begins beside it."""
    layers = {layer.id: layer for layer in bench.layers()}
    truth = bench.candidate((layers["coulomb_friction@w_em"],))
    series = recorded(truth, {**TRUTH, **FRICTION})
    base = based(dataclasses.replace(bench, series=series))
    candidate = bench.candidate((layers["sensor_lag@w_em"],))
    point = extended(candidate, base.candidate, base.point, {})
    return series, base, looked_at(candidate, series, base.noises, point)


def test_states_that_both_have_are_those_of_the_known_one(pair: Pair) -> None:
    _, base, begun = pair
    names, known = begun.candidate.predictor.states, base.candidate.predictor.states
    near = seen_like(begun.candidate, begun.outcome, base.candidate, base.outcome)
    own, theirs = begun.outcome.runs.whole.states, base.outcome.runs.whole.states
    for k, name in enumerate(names):
        expected = theirs[:, known.index(name)] if name in known else own[:, k]
        assert np.array_equal(near.runs.whole.states[:, k], expected), name
    assert set(names) - set(known), "the lag has a state of its own"
    assert np.array_equal(near.joined, begun.outcome.joined)


def test_an_outcome_of_other_recordings_tells_nothing(pair: Pair) -> None:
    _, base, begun = pair
    runs = base.outcome.runs
    short = dataclasses.replace(runs.whole, states=runs.whole.states[:-1])
    other = dataclasses.replace(base.outcome, runs=dataclasses.replace(runs, whole=short))
    assert seen_like(begun.candidate, begun.outcome, base.candidate, other) is begun.outcome
    ended = dataclasses.replace(base.outcome, is_whole=False)
    assert seen_like(begun.candidate, begun.outcome, base.candidate, ended) is begun.outcome


def test_a_model_near_it_never_makes_a_candidate_worse(pair: Pair) -> None:
    series, base, begun = pair
    given = begun.candidate, series, base.noises, begun.point
    assert looked_like(*given, base).cost <= looked_at(*given).cost
    assert looked_like(*given, None).cost == begun.cost
