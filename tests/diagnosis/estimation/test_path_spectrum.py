"""Path spectrum: the order of a wave over a path is found among noise and drifts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from diagnosis.estimation.path_spectrum import PEAKS, strongest_orders

COUNT = 3000
HIGH = 1e6


def run_of(order: float, seed: int, drift: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A path with changing speed, and noise with a wave of half its size over it."""
    random = np.random.default_rng(seed)
    speed = 3.0 + 2.0 * np.sin(np.arange(COUNT) / 400.0 + seed)
    path = np.cumsum(speed) * 0.01
    wave = 0.5 * np.sin(order * path + random.uniform(0.0, 6.0))
    walk = drift * np.cumsum(random.normal(size=COUNT))
    return path, (wave + walk + random.normal(size=COUNT))[:, np.newaxis]


@pytest.mark.parametrize("drift", [0.0, 0.2])
@given(order=st.floats(8.0, 40.0), seed=st.integers(0, 99))
def test_the_order_of_a_wave_is_among_the_strongest(drift: float, order: float, seed: int) -> None:
    runs = [run_of(order, seed, drift), run_of(order, seed + 100, drift)]
    paths, innovations = ([one[k] for one in runs] for k in (0, 1))
    found = strongest_orders(paths, innovations, 0.01, HIGH)
    resolution = 2.0 * np.pi / max(np.ptp(path) for path in paths)
    assert len(found) == PEAKS
    assert min(abs(one - order) for one in found[1:]) <= resolution


def test_the_unit_of_the_path_scales_the_orders() -> None:
    path, innovations = run_of(12.0, 5)
    metres, millimetres = (
        strongest_orders([path * unit], [innovations], 1e-9, 1e12) for unit in (1.0, 1000.0)
    )
    assert np.array(millimetres) * 1000.0 == pytest.approx(np.array(metres))


def test_orders_stay_between_their_bounds() -> None:
    path, innovations = run_of(12.0, 5)
    assert all(1.0 <= one <= 8.0 for one in strongest_orders([path], [innovations], 1.0, 8.0))


@pytest.mark.parametrize("path", [np.zeros(50), np.full(50, np.nan), np.empty(0)])
def test_without_a_path_there_are_no_orders(path: np.ndarray) -> None:
    assert strongest_orders([path], [np.ones((len(path), 1))], 0.1, 9.0) == ()
    assert strongest_orders([], [], 0.1, 9.0) == ()


def test_unknown_innovations_count_as_nothing() -> None:
    path, innovations = run_of(12.0, 5)
    innovations[::7] = np.nan
    found = strongest_orders([path], [innovations], 0.01, HIGH)
    assert min(abs(one - 12.0) for one in found) < 0.1
