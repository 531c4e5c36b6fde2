"""Modes: where each was seen, and what is kept of a candidate there."""

from __future__ import annotations

from fractions import Fraction
from itertools import groupby
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, strategies as st

from codegen.predictor.predictor_arrays import Prediction, StackedPrediction
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.innovations import PredictionResult
from diagnosis.estimation.linearisation import _pseudoinverse, linearise
from diagnosis.estimation.operating_point import (
    _dwell_intervals,
    _largest_output,
    operating_points,
)

RUN = st.lists(st.integers(-1, 1), min_size=1, max_size=12).flatmap(
    lambda modes: st.tuples(st.just(modes), st.integers(0, len(modes)))
)
"""The modes of a recording, and how many of its samples were done."""


def runs_of(recordings: list[tuple[list[int], int]]) -> StackedPrediction:
    modes = np.array([mode for one, _ in recordings for mode in one], dtype=np.int16)
    starts = np.cumsum([0, *(len(one) for one, _ in recordings)], dtype=np.int64)
    nothing = np.zeros((len(modes), 1))
    whole = Prediction(nothing, nothing, nothing, modes, len(modes))
    done = np.array([count for _, count in recordings], dtype=np.int64)
    return StackedPrediction(whole, starts, done, np.zeros((len(recordings), 1)), nothing)


@given(st.lists(RUN, min_size=1, max_size=5))
def test_stays_are_the_groups_of_equal_modes(recordings: list[tuple[list[int], int]]) -> None:
    wanted = []
    for r, (modes, done) in enumerate(recordings):
        at = 0
        for mode, group in groupby(modes[:done]):
            length = len(list(group))
            wanted.append((at, at + length, mode, r))
            at += length
    found = _dwell_intervals(runs_of(recordings))
    assert list(zip(*(part.tolist() for part in found), strict=True)) == wanted


@pytest.mark.parametrize("states", [1, 2, 7, 10])
def test_an_inverse_has_the_bits_of_numpy(states: int) -> None:
    draw = np.random.default_rng(states)
    for _ in range(50):
        whole = draw.normal(size=(states, states))
        flat = whole.copy()
        flat[-1] = flat[0] * (states > 1)
        for matrix in (whole, flat, np.eye(states), np.zeros((states, states))):
            assert np.array_equal(_pseudoinverse(matrix), np.linalg.pinv(matrix))


OUTPUTS = st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), min_size=10, max_size=10)
ANY: Any = cast(Any, None)


def point_of(recordings: list[np.ndarray]) -> tuple[list[float], list[float]]:
    """The states and input sizes of the operating point of recordings in one mode.

    A state is the number of the sample, the only input the first output.
    """
    modes = np.zeros(sum(map(len, recordings)), dtype=np.int16)
    starts = np.cumsum([0, *map(len, recordings)], dtype=np.int64)
    nothing = np.zeros((len(modes), 1))
    states = np.concatenate([10.0 * one.sum() + np.arange(len(one)) for one in recordings])
    whole = Prediction(nothing, nothing, states[:, np.newaxis], modes, len(modes))
    runs = StackedPrediction(whole, starts, np.diff(starts), nothing[:1], nothing[:1])
    series = [
        SampledRecording("a", Fraction(1), Fraction(0), one[:, :1], one) for one in recordings
    ]
    found = operating_points(ANY, series, PredictionResult(runs, np.zeros(1, np.int64), ANY))
    return found[0].states.tolist(), found[0].input_sizes.tolist()


@given(st.lists(OUTPUTS, min_size=2, max_size=3))
def test_the_order_of_recordings_does_not_move_the_operating_point(rows: list[Any]) -> None:
    recordings = [np.array(one) + np.linspace(0.0, 1e-3 * k, 2) for k, one in enumerate(rows, 1)]
    assert point_of(recordings) == point_of(recordings[::-1])


@given(OUTPUTS, st.integers(-9, 9))
def test_units_and_order_of_outputs_do_not_move_the_operating_point(
    rows: list[Any], decade: int
) -> None:
    one = np.array(rows)
    measured = np.column_stack([one, one[:, 0]])
    swapped = np.column_stack([one[:, ::-1] * [2.0**decade, 1.0], one[:, 0]])
    wanted = _largest_output(measured, 0, 10, np.abs(measured).max(axis=0))
    assert _largest_output(swapped, 0, 10, np.abs(swapped).max(axis=0)) == pytest.approx(wanted)


@given(st.integers(-40, 40))
def test_steps_of_a_linearisation_scale_with_units(power: int) -> None:
    """Only a power of two scales without rounding."""
    factor, seen = 2.0**power, []

    class Recorder:
        def compute_jacobians(self, *given: Any) -> tuple[np.ndarray, ...]:
            seen.append(given[-2:])
            return np.eye(2), np.eye(2), np.eye(2)

    states, inputs = np.array([3.0, 0.0]), np.array([0.0, 5.0])
    for scale in (1.0, factor):
        given_steps = scale * np.array([1e-14, 1e-3]), scale * np.array([2.0, 5.0])
        linearise(cast(Any, Recorder()), inputs, 0, 1, scale * states, scale * inputs, *given_steps)
    for before, after in zip(*seen, strict=True):
        assert np.array_equal(factor * before, after)
