"""Sensitivity designs: generate the points of Saltelli blocks and Morris paths.

Saltelli et al., Comput. Phys. Commun. 181 (2010) 259; Morris, Technometrics 33 (1991) 161.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from engine.results.array_types import Reals
from sweep.definition.study import MORRIS_LEVELS

STRIDE = MORRIS_LEVELS // 2
"""Levels of one step of a Morris path, half of all, so that all levels are equally frequent."""


def saltelli_points(
    dimensions: int, samples: NDArray[np.int64], sobol: Callable[[int], Reals]
) -> Reals:
    """Return the quantile levels (n_samples, dimensions) of samples of a Saltelli design.

    `samples` are indices. A block has dimensions + 2 samples: row A, row B, then A with column i of
    B for each i. `sobol` returns the row (2 * dimensions,) of a sequence for a block number, A and
    B side by side.
    """
    points = np.empty((len(samples), dimensions))
    for place, sample in enumerate(samples.tolist()):
        row, part = divmod(sample, dimensions + 2)
        both = sobol(row)
        points[place] = both[dimensions:] if part == 1 else both[:dimensions]
        if part > 1:
            points[place, part - 2] = both[dimensions + part - 2]
    return points


def morris_points(dimensions: int, samples: NDArray[np.int64], seed: int) -> Reals:
    """Return the quantile levels (n_samples, dimensions) of samples of Morris paths.

    `samples` are indices. A path has dimensions + 1 samples; each step changes one variable by
    STRIDE of the MORRIS_LEVELS levels, in random order and direction. Path k depends on `seed` and
    k only.
    """
    paths: dict[int, Reals] = {}
    points = np.empty((len(samples), dimensions))
    for place, sample in enumerate(samples.tolist()):
        number, step = divmod(sample, dimensions + 1)
        if number not in paths:
            paths[number] = _morris_path(dimensions, seed, number)
        points[place] = paths[number][step]
    return points


def _morris_path(dimensions: int, seed: int, number: int) -> Reals:
    """Return the quantile levels (dimensions + 1, dimensions) of one path, by seed and path
    number.
    """
    key = np.array([seed, number], dtype=np.uint64)
    source = np.random.Generator(np.random.Philox(key=key))
    order = source.permutation(dimensions)
    low = source.integers(0, STRIDE, dimensions)
    is_up = source.integers(0, 2, dimensions) == 1
    levels = np.tile(np.where(is_up, low, low + STRIDE), (dimensions + 1, 1))
    for place, column in enumerate(order.tolist(), start=1):
        levels[place:, column] += STRIDE if is_up[column] else -STRIDE
    return (levels + 0.5) / MORRIS_LEVELS
