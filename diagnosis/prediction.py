"""Prediction: how well a candidate foresees recordings, one sample ahead, by its observer.

Innovations form (Ljung 1999, section 7.4): the observer's gain is recomputed from the candidate
itself, so a wrong model cannot hide behind the gain of another one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from codegen.predictor import Predictor
from codegen.runs import Prediction, Recorded, Runs
from diagnosis.candidate import Candidate
from diagnosis.joined import joined
from diagnosis.noise import MAD
from diagnosis.point import Point, values_at
from diagnosis.series import Series

Reals = NDArray[np.float64]
DRIFTS, SIGNAL, INPUTS = "level of {}", "noise of {}", "noise of inputs"
"""Names of levels that a fit moves: of a drift, of a compared signal, of all inputs."""
FOLDS = 5
"""Parts of the recordings that are left out in turn: every fifth block in time of each."""


@dataclass(frozen=True)
class Noises:
    """What is known of noise: of the `seen` signals, of the inputs, and of each drift [SI].

    Innovations beyond `limits` (seen,) count in proportion, not as squares: an event that is
    foreseen a sample late must not outweigh all others. With `is_alone` nothing is corrected once
    the states have been found: an innovation is then what a simulation misses.
    """

    seen: Reals
    inputs: Reals
    drifts: Mapping[str, float]
    limits: Reals
    is_alone: bool = False


@dataclass(frozen=True)
class Gains:
    """The gains of one candidate at one point: `first` (count, states, seen), `steady` by mode."""

    first: Reals
    steady: Reals


@dataclass(frozen=True)
class Block:
    """A `part` of the joined innovations, of a `recording`; left out with others of its `fold`."""

    recording: int
    fold: int
    part: slice


@dataclass(frozen=True)
class Outcome:
    """How recordings were foreseen: their `runs`, of which the samples `skips` do not count.

    Innovations beyond `limits` (seen,) count in proportion. `is_whole` where no run left all
    bounds.
    """

    runs: Runs = field(repr=False)
    skips: NDArray[np.int64] = field(repr=False)
    limits: Reals = field(repr=False)
    is_whole: bool = True

    @cached_property
    def predictions(self) -> tuple[Prediction, ...]:
        """The run of each recording."""
        return self.runs.each()

    @cached_property
    def joined(self) -> Reals:
        """The innovations of all recordings behind their burn-in, one after the other (n, seen)."""
        return _counted(self.runs.whole.innovations, self.runs.starts, self.skips)

    @cached_property
    def parts(self) -> list[slice]:
        """Where the innovations of each recording are among the joined ones."""
        return [slice(low, high) for low, high in pairwise(self._edges)]

    @property
    def innovations(self) -> tuple[Reals, ...]:
        """The innovations of each recording behind its burn-in, (samples, seen) each."""
        return tuple(self.joined[part] for part in self.parts)

    @cached_property
    def blocks(self) -> list[Block]:
        """The recordings, each cut into `FOLDS` blocks."""
        return _blocks(self._edges)

    @property
    def _edges(self) -> tuple[int, ...]:
        """Where each recording begins among the joined innovations, and where the last one ends."""
        starts = self.runs.starts
        lengths = np.maximum(starts[1:] - starts[:-1] - self.skips, 0)
        return 0, *np.cumsum(lengths).tolist()

    def cost(self) -> float:
        """Return sum over channels of N/2 log(mean square), the negative log likelihood [nats]."""
        if not self.is_whole:
            return np.inf
        return float((0.5 * self.counts * np.log(self.variances)).sum())

    @cached_property
    def squares(self) -> Reals:
        """The joined squares that count (Huber 1964), (n, seen)."""
        size = np.abs(self.joined)
        near = np.minimum(size, self.limits)
        return np.asarray(near * (2.0 * size - near), dtype=np.float64)

    def robust(self) -> Reals:
        """Return the standard deviation of the innovations by their median (seen,)."""
        return MAD * np.nanmedian(np.abs(self.joined), axis=0)

    @cached_property
    def counts(self) -> Reals:
        """How many innovations each channel has (seen,)."""
        return np.asarray(self.runs.counts.sum(axis=0), dtype=np.float64)

    @cached_property
    def variances(self) -> Reals:
        """The mean square innovation of each channel (seen,)."""
        squares = self.runs.squares.sum(axis=0)
        found: Reals = np.maximum(squares / np.maximum(self.counts, 1.0), 1e-300)
        return found


@dataclass(frozen=True)
class Innovations:
    """What was not foreseen of recordings at a point: `whole` (samples, seen) by a predictor, which
    has `done` so many samples of each recording before a value left all bounds.
    """

    whole: Reals
    done: NDArray[np.int64]
    recorded: Recorded
    limits: Reals
    predictor: Predictor

    @cached_property
    def joined(self) -> Reals:
        """The innovations behind the burn-in of each recording (n, seen), as in an Outcome."""
        return _counted(self.whole, self.recorded.starts, self.recorded.skips)

    @property
    def each(self) -> tuple[Reals, ...]:
        """The innovations of each recording behind its burn-in, (samples, seen) each."""
        return tuple(_each_counted(self.whole, self.recorded.starts, self.recorded.skips))

    @property
    def squares(self) -> Reals:
        """The sums of the squares that count (recordings, seen)."""
        return self._sums[0]

    @property
    def counts(self) -> Reals:
        """How many innovations of each recording each channel has (recordings, seen)."""
        return self._sums[1]

    @cached_property
    def _sums(self) -> tuple[Reals, Reals]:
        return self.predictor.squares(self.whole, self.recorded, self.limits)


def noises_of(series: Sequence[Series], drifts: Mapping[str, float]) -> Noises:
    """Return the noise of the signals and inputs of some recordings: the median over them."""
    seen, inputs = [np.array([one.noise[k] for one in series]) for k in (0, 1)]
    floor = [float(np.nanmax(np.abs(one.measured))) * 1e-6 + 1e-12 for one in series]
    known = np.maximum(np.median(seen, axis=0), np.median(floor))
    return Noises(known, np.median(inputs, axis=0), drifts, np.full(len(known), np.inf))


def noises_at(candidate: Candidate, point: Point, noises: Noises) -> Noises:
    """Return noises with the levels that a candidate has as coordinates, at a point."""
    if not candidate.levels:
        return noises
    values = values_at(candidate, point, 0)
    named = {name: values.get(DRIFTS.format(name)) for name in candidate.drifts}
    drifts = {name: level for name, level in named.items() if level is not None}
    signals = zip(candidate.predictor.seen, noises.seen, strict=True)
    seen = np.array([values.get(SIGNAL.format(name), noise) for name, noise in signals])
    most = np.max(noises.inputs, initial=0.0)
    inputs = noises.inputs * (values[INPUTS] / most) if INPUTS in values else noises.inputs
    return dataclasses.replace(noises, drifts={**noises.drifts, **drifts}, seen=seen, inputs=inputs)


def predicted(
    candidate: Candidate,
    series: Sequence[Series],
    values: Sequence[Mapping[str, float]],
    gains: Gains,
    limits: Reals,
) -> Outcome:
    """Return the innovations of recordings, each with values of its own (per recording)."""
    together = joined(series)
    recorded = together.recorded
    runs = candidate.predictor.predict_all(
        candidate.pages(values, together.first),
        recorded,
        gains.first,
        gains.steady,
        candidate.recipe.substeps,
        limits,
    )
    whole = bool(np.all(runs.done == recorded.starts[1:] - recorded.starts[:-1]))
    return Outcome(runs, recorded.skips, limits, whole)


def foreseen_at(
    candidate: Candidate,
    series: Sequence[Series],
    values: Sequence[Sequence[Mapping[str, float]]],
    gains: Gains,
    limits: Reals,
) -> list[Innovations]:
    """Return the innovations of recordings at several points, each with `values` for each of them.

    All points are followed side by side; nothing is told of states.
    """
    together = joined(series)
    recorded, predictor = together.recorded, candidate.predictor
    runs = predictor.predict_points(
        np.array([candidate.pages(one, together.first) for one in values]),
        recorded,
        gains.first,
        gains.steady,
        candidate.recipe.substeps,
    )
    return [Innovations(*run, recorded, limits, predictor) for run in zip(*runs, strict=True)]


def foreseen_with(
    candidate: Candidate,
    series: Sequence[Series],
    values: Sequence[Mapping[str, float]],
    gains: Sequence[Gains],
    limits: Reals,
) -> list[Innovations]:
    """Return the innovations of recordings, each with values of its own, with several gains.

    Those with as many first ones are followed side by side; nothing is told of states.
    """
    together = joined(series)
    recorded, predictor = together.recorded, candidate.predictor
    pages, found = candidate.pages(values, together.first), dict[int, Innovations]()
    for count in {len(one.first) for one in gains}:
        alike = [k for k, one in enumerate(gains) if len(one.first) == count]
        runs = predictor.predict_points(
            np.repeat(pages[np.newaxis], len(alike), axis=0),
            recorded,
            np.array([gains[k].first for k in alike]),
            np.array([gains[k].steady for k in alike]),
            candidate.recipe.substeps,
        )
        for k, run in zip(alike, zip(*runs, strict=True), strict=True):
            found[k] = Innovations(*run, recorded, limits, predictor)
    return [found[k] for k in range(len(gains))]


@lru_cache
def _blocks(edges: tuple[int, ...]) -> list[Block]:
    """Return recordings with such edges, each cut into `FOLDS` blocks."""
    found = []
    for r, (start, stop) in enumerate(pairwise(edges)):
        cuts = np.linspace(0, stop - start, FOLDS + 1).astype(int) + start
        parts = [slice(low, high) for low, high in pairwise(cuts.tolist())]
        found += [Block(r, (r + k) % FOLDS, part) for k, part in enumerate(parts)]
    return found


def _counted(innovations: Reals, starts: NDArray[np.int64], skips: NDArray[np.int64]) -> Reals:
    """Return the innovations of all recordings behind their burn-in, one after the other."""
    return np.concatenate(_each_counted(innovations, starts, skips))


def _each_counted(
    innovations: Reals, starts: NDArray[np.int64], skips: NDArray[np.int64]
) -> list[Reals]:
    edges = zip((starts[:-1] + skips).tolist(), starts[1:].tolist(), strict=True)
    return [innovations[low:high] for low, high in edges]
