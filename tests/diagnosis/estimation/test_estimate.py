"""A candidate has its modes where a model near it was seen to have them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate, evaluate, evaluate_near, share_operating_points
from diagnosis.estimation.model_set import ModelSet
from diagnosis.model.parameter_vector import extend_vector
from tests.diagnosis.estimation.test_levenberg_marquardt import (
    FRICTION,
    TRUTH,
    bench,
    simulate_recordings,
)
from tests.diagnosis.localisation.test_ranking import fit_first_base

__all__ = ["bench"]
Pair = tuple[tuple[SampledRecording, ...], Estimate, Estimate]


@pytest.fixture(scope="module")
def pair(bench: ModelSet) -> Pair:
    """Return recordings with the base fitted to them, and a candidate as it begins beside it."""
    layers = {layer.id: layer for layer in bench.applicable_effects()}
    truth = bench.compile_candidate((layers["coulomb_friction@w_em"],))
    series = simulate_recordings(truth, {**TRUTH, **FRICTION})
    base = fit_first_base(dataclasses.replace(bench, series=series))
    candidate = bench.compile_candidate((layers["sensor_lag@w_em"],))
    point = extend_vector(candidate, base.candidate, base.point, {})
    return series, base, evaluate(candidate, series, base.noise_levels, point)


def test_states_that_both_have_are_those_of_the_known_one(pair: Pair) -> None:
    _, base, begun = pair
    names, known = begun.candidate.predictor.states, base.candidate.predictor.states
    near = share_operating_points(
        begun.candidate, begun.prediction, base.candidate, base.prediction
    )
    own, theirs = begun.prediction.runs.stacked.states, base.prediction.runs.stacked.states
    for k, name in enumerate(names):
        expected = theirs[:, known.index(name)] if name in known else own[:, k]
        assert np.array_equal(near.runs.stacked.states[:, k], expected), name
    assert set(names) - set(known), "the lag has a state of its own"
    assert np.array_equal(near.stacked, begun.prediction.stacked)


def test_an_outcome_of_other_recordings_tells_nothing(pair: Pair) -> None:
    _, base, begun = pair
    runs = base.prediction.runs
    short = dataclasses.replace(runs.stacked, states=runs.stacked.states[:-1])
    other = dataclasses.replace(base.prediction, runs=dataclasses.replace(runs, stacked=short))
    assert (
        share_operating_points(begun.candidate, begun.prediction, base.candidate, other)
        is begun.prediction
    )
    ended = dataclasses.replace(base.prediction, is_complete=False)
    assert (
        share_operating_points(begun.candidate, begun.prediction, base.candidate, ended)
        is begun.prediction
    )


def test_a_model_near_it_never_makes_a_candidate_worse(pair: Pair) -> None:
    series, base, begun = pair
    given = begun.candidate, series, base.noise_levels, begun.point
    assert evaluate_near(*given, base).cost <= evaluate(*given).cost
    assert evaluate_near(*given, None).cost == begun.cost
