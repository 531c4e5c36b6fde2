"""Random draws: compute the drawn values of any sample without computing the previous ones.

Random numbers come from Philox 4x64 (Salmon et al. 2011) with one stream for each variable name.
Latin hypercubes and scrambled Sobol sequences come from scipy.stats.qmc.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from engine.results.array_types import Reals
from engine.simulation.sensors import philox_of
from sweep.definition.study import TIME_DECIMALS, Distribution, Study, design_group_size
from sweep.definition.truncation import truncation_levels
from sweep.design.sensitivity_design import morris_points, saltelli_points

NUMBERS_PER_COUNTER = 4
"""Numbers that Philox 4x64 generates for one counter value."""

OPEN_UNIT_MARGIN = 2.0**-54
"""Half the distance of two random numbers in [0, 1); it is added so that no level is 0 or 1."""


def draw_values(study: Study, samples: Sequence[int]) -> list[dict[str, float]]:
    """Return the drawn values [SI] by variable name, one dict for each of the samples.

    `samples` are indices; the values of an index do not depend on the others. Times in inputs are
    rounded to nanoseconds. Without random variables the dicts are empty.
    """
    drawn = study.random_variables
    if not drawn:
        return [{} for _ in samples]
    shares = _unit_cube_points(study, np.asarray(samples, dtype=np.int64))
    columns = []
    for place, varied in enumerate(drawn):
        assert isinstance(varied.distribution, Distribution)
        values = quantile(varied.distribution, shares[:, place])
        if any(target.is_input_time for target in varied.targets):
            values = np.round(values, TIME_DECIMALS)
        columns.append(values.tolist())
    names = [varied.name for varied in drawn]
    return [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]


def quantile(distribution: Distribution, level: Reals) -> Reals:
    """Return the values [SI] (n,) of a distribution at the quantile levels (n,) in (0, 1).

    With `within`, the levels are those of the truncated distribution, and values are clipped to its
    bounds. Of a choice, a level on a boundary gives the later value.
    """
    if distribution.shape == "choice":
        weights = np.asarray(distribution.weights or [1.0] * len(distribution.numbers))
        bounds = np.cumsum(weights) / np.sum(weights)
        places = np.searchsorted(bounds[:-1], level, side="right")
        return np.asarray(distribution.numbers)[places]
    first, second = distribution.numbers
    if distribution.shape == "uniform":
        return first + (second - first) * level
    if distribution.shape == "log_uniform":
        return np.asarray(np.exp(np.log(first) + np.log(second / first) * level))
    from scipy.special import ndtri  # deferred: the import of scipy takes long

    is_log = distribution.shape == "lognormal"
    if distribution.within:
        low, high = truncation_levels(distribution)
        level = low + (high - low) * level
    deviate = ndtri(level)
    found = first * np.exp(second * deviate) if is_log else first + second * deviate
    return np.clip(found, *distribution.within) if distribution.within else np.asarray(found)


def _unit_cube_points(study: Study, samples: NDArray[np.int64]) -> Reals:
    """Return the quantile levels (n_samples, n_random) in (0, 1) of the samples."""
    names = tuple(varied.name for varied in study.random_variables)
    sampling = study.sampling
    if sampling.method == "latin_hypercube":
        return _latin_hypercube_points(len(names), sampling.count, sampling.seed)[samples]
    if sampling.method == "morris":
        return morris_points(len(names), samples, sampling.seed)
    if sampling.method == "saltelli":
        rows = samples // design_group_size(sampling.method, len(names))
        first = int(rows.min())
        both = _sobol_points(2 * len(names), sampling.seed, first, int(rows.max()) - first + 1)
        return saltelli_points(len(names), samples, lambda row: np.asarray(both[row - first]))
    unique, places = np.unique(samples, return_inverse=True)
    ends = [0, *(np.flatnonzero(np.diff(unique) > 1) + 1).tolist(), len(unique)]
    parts = []
    for begin, end in pairwise(ends):
        first, count = int(unique[begin]), end - begin
        if sampling.method == "sobol":
            parts.append(_sobol_points(len(names), sampling.seed, first, count))
        else:
            columns = [_random_stream(sampling.seed, name, first, count) for name in names]
            parts.append(np.stack(columns, axis=1))
    return np.concatenate(parts)[places.reshape(-1)]


def _random_stream(seed: int, name: str, first: int, count: int) -> Reals:
    """Return the numbers `first` to `first + count` (exclusive) of the stream of a variable
    name.
    """
    source = philox_of(seed, name).advance(first // NUMBERS_PER_COUNTER)
    skipped = first % NUMBERS_PER_COUNTER
    numbers = np.random.Generator(source).random(skipped + count)[skipped:]
    return np.asarray(numbers + OPEN_UNIT_MARGIN)


def _sobol_points(dimensions: int, seed: int, first: int, count: int) -> Reals:
    """Return rows `first` to `first + count` (exclusive) of a scrambled Sobol sequence (count,
    d).
    """
    from scipy.stats import qmc

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # the number of rows is no power of 2
        engine = qmc.Sobol(d=dimensions, scramble=True, seed=seed)
        if first:
            engine.fast_forward(first)
        return _clip_to_open_unit(engine.random(count))


@lru_cache(maxsize=1)
def _latin_hypercube_points(dimensions: int, count: int, seed: int) -> Reals:
    """Return all points (count, d) of a Latin hypercube; the last design is cached."""
    from scipy.stats import qmc

    return _clip_to_open_unit(qmc.LatinHypercube(d=dimensions, seed=seed).random(count))


def _clip_to_open_unit(points: Reals) -> Reals:
    """Return points clipped to the open interval (0, 1)."""
    return np.clip(points, OPEN_UNIT_MARGIN, 1.0 - 2.0 * OPEN_UNIT_MARGIN)
