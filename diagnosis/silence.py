"""Silence: parameters from where a hidden input is silent, for what it does where it is not.

While it is free everywhere it takes up what a wrong mass or drag leaves over, and nothing tells the
two apart. Where it is silent the model has to follow without it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimate import Estimate, looked_at
from diagnosis.freedom import ALL_LEVELS, SMALL_LEVEL, scanned, with_levels
from diagnosis.joined import burnt
from diagnosis.level import FIRST_LEVELS, settled, units_of
from diagnosis.point import Point
from diagnosis.series import Series

Truths = NDArray[np.bool_]
MARGIN = 0.5
"""Seconds before and behind it in which an input is not yet silent."""
SHORTEST = 2.0
"""Seconds that a silence lasts at least: the states have to be found in it."""
STARTS = (FIRST_LEVELS[0], FIRST_LEVELS[-1])
"""Levels of all drifts from which the silences are fitted."""
MOST = 1.0 / 3.0
"""Part of the recordings that silences have at least, if parameters are to follow from them."""


def from_silence(
    model: Estimate, series: Sequence[Series], loud: Sequence[Truths], name: str
) -> Estimate:
    """Return a model whose drift of a `name` is free, its parameters from where that is not `loud`,
    told for each recording behind its burn-in (samples,).

    As it is where there is not silence enough.
    """
    pieces, places = _pieces(series, loud)
    if sum(one.count for one in pieces) < MOST * sum(one.count for one in series):
        return model
    units = units_of(model.candidate, series, model.values(0))
    own = [places.index(r) if r in places else 0 for r in range(len(series))]
    start = Point(model.point.shared, model.point.own[places])
    found = []
    for level in STARTS:
        noises = with_levels(model.noises, units, dict.fromkeys(units, level))
        found.append(settled(model.candidate, pieces, noises, start, units))
    quiet = min(found, key=lambda one: one.cost)
    point = Point(quiet.point.shared, quiet.point.own[own])
    small = with_levels(model.noises, units, dict.fromkeys(units, SMALL_LEVEL))
    free = looked_at(model.candidate, series, small, point)
    return scanned(free, series, units, name, ALL_LEVELS)


def _pieces(series: Sequence[Series], loud: Sequence[Truths]) -> tuple[list[Series], list[int]]:
    """Return the silences, each as a recording, the longest first, and where they are from."""
    found = []
    for r, (one, there) in enumerate(zip(series, loud, strict=True)):
        around = np.ones(2 * round(MARGIN / float(one.period)) + 1)
        near = np.convolve(np.pad(there, (burnt(one), 0)).astype(float), around, "same") > 0.5
        found += [(part, r) for part in _silences(one, near)]
    found.sort(key=lambda pair: -pair[0].count)
    return [part for part, _ in found], [r for _, r in found]


def _silences(one: Series, loud: Truths) -> list[Series]:
    """Return the silent parts of a recording, each from where all signals are known."""
    edges = [0, *(np.flatnonzero(np.diff(loud)) + 1).tolist(), one.count]
    known = np.flatnonzero(np.all(np.isfinite(one.measured), axis=1))
    found = []
    for low, high in pairwise(edges):
        first = known[np.searchsorted(known, low) :][:1]
        if not loud[low] and len(first) and (high - first[0]) * float(one.period) >= SHORTEST:
            part = slice(int(first[0]), high)
            found.append(
                dataclasses.replace(
                    one,
                    start=one.start + one.period * part.start,
                    inputs=np.ascontiguousarray(one.inputs[part]),
                    measured=np.ascontiguousarray(one.measured[part]),
                )
            )
    return found
