"""Draw: the drawn values of any sample, without those before it.

Random numbers come from Philox 4x64 (Salmon and others 2011), one stream per name; Latin hypercubes
and scrambled Sobol sequences are those of scipy.stats.qmc.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sweep.design import morris_shares, saltelli_shares
from sweep.study import NANOSECONDS, Distribution, Study, points_each

Reals = NDArray[np.float64]
PER_COUNTER = 4
"""Numbers that Philox makes of one count."""
HALF_STEP = 2.0**-54
"""Half of the distance of two random numbers in [0, 1): so none is 0 or 1."""


def drawn_values(study: Study, samples: Sequence[int]) -> list[dict[str, float]]:
    """Return the values [SI] of what is drawn, by name, for each of some samples."""
    drawn = study.drawn
    if not drawn:
        return [{} for _ in samples]
    shares = _shares(study, np.asarray(samples, dtype=np.int64))
    columns = []
    for place, varied in enumerate(drawn):
        assert isinstance(varied.course, Distribution)
        values = quantile(varied.course, shares[:, place])
        if any(target.is_input_time for target in varied.targets):
            values = np.round(values, NANOSECONDS)
        columns.append(values.tolist())
    names = [varied.name for varied in drawn]
    return [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]


def quantile(course: Distribution, share: Reals) -> Reals:
    """Return the values [SI] (n,) of a distribution at shares (n,) in (0, 1)."""
    if course.shape == "choice":
        weights = np.asarray(course.weights or [1.0] * len(course.numbers))
        bounds = np.cumsum(weights) / np.sum(weights)
        places = np.searchsorted(bounds[:-1], share, side="right")
        return np.asarray(course.numbers)[places]
    first, second = course.numbers
    if course.shape == "uniform":
        return first + (second - first) * share
    if course.shape == "log_uniform":
        return np.asarray(np.exp(np.log(first) + np.log(second / first) * share))
    from scipy.special import ndtri  # scipy only where it is needed

    is_log = course.shape == "lognormal"
    if course.within:
        low, high = shares_within(course)
        share = low + (high - low) * share
    deviate = ndtri(share)
    found = first * np.exp(second * deviate) if is_log else first + second * deviate
    return np.clip(found, *course.within) if course.within else np.asarray(found)


def shares_within(course: Distribution) -> tuple[float, float]:
    """Return the shares of a normal or lognormal at the ends of its `within`."""
    from scipy.special import ndtr

    assert course.within
    is_log = course.shape == "lognormal"
    first, second = course.numbers
    ends = np.log(np.maximum(course.within, 1e-300)) if is_log else np.asarray(course.within)
    low, high = ndtr((ends - (np.log(first) if is_log else first)) / second)
    return float(low), float(high)


def _shares(study: Study, samples: NDArray[np.int64]) -> Reals:
    """Return shares in (0, 1) (n_samples, n_drawn)."""
    names = tuple(varied.name for varied in study.drawn)
    sampling = study.sampling
    if sampling.method == "latin_hypercube":
        return _hypercube(len(names), sampling.count, sampling.seed)[samples]
    if sampling.method == "morris":
        return morris_shares(len(names), samples, sampling.seed)
    if sampling.method == "saltelli":
        rows = samples // points_each(sampling.method, len(names))
        first = int(rows.min())
        both = _sobol(2 * len(names), sampling.seed, first, int(rows.max()) - first + 1)
        return saltelli_shares(len(names), samples, lambda row: np.asarray(both[row - first]))
    unique, places = np.unique(samples, return_inverse=True)
    ends = [0, *(np.flatnonzero(np.diff(unique) > 1) + 1).tolist(), len(unique)]
    parts = []
    for begin, end in pairwise(ends):
        first, count = int(unique[begin]), end - begin
        if sampling.method == "sobol":
            parts.append(_sobol(len(names), sampling.seed, first, count))
        else:
            columns = [_stream(sampling.seed, name, first, count) for name in names]
            parts.append(np.stack(columns, axis=1))
    return np.concatenate(parts)[places.reshape(-1)]


def _stream(seed: int, name: str, first: int, count: int) -> Reals:
    """Return the numbers `first` to `first + count` of the stream of a name."""
    digest = hashlib.sha256(name.encode()).digest()
    key = np.array([seed, int.from_bytes(digest[:8], "little")], dtype=np.uint64)
    source = np.random.Philox(key=key).advance(first // PER_COUNTER)
    skipped = first % PER_COUNTER
    numbers = np.random.Generator(source).random(skipped + count)[skipped:]
    return np.asarray(numbers + HALF_STEP)


def _sobol(dimensions: int, seed: int, first: int, count: int) -> Reals:
    from scipy.stats import qmc

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of a part that is no power of 2
        engine = qmc.Sobol(d=dimensions, scramble=True, seed=seed)
        if first:
            engine.fast_forward(first)
        return _inside(engine.random(count))


@lru_cache(maxsize=1)
def _hypercube(dimensions: int, count: int, seed: int) -> Reals:
    from scipy.stats import qmc

    return _inside(qmc.LatinHypercube(d=dimensions, seed=seed).random(count))


def _inside(shares: Reals) -> Reals:
    return np.clip(shares, HALF_STEP, 1.0 - 2.0 * HALF_STEP)
