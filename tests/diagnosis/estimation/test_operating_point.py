"""Modes: where each was seen, and what is kept of a candidate there."""

from __future__ import annotations

from itertools import groupby

import numpy as np
import pytest
from hypothesis import given, strategies as st

from codegen.predictor.predictor_arrays import Prediction, StackedPrediction
from diagnosis.estimation.linearisation import _pseudoinverse
from diagnosis.estimation.operating_point import _dwell_intervals

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
