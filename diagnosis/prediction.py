"""Prediction: how well a candidate foresees recordings, one sample ahead, by its observer.

Innovations form (Ljung 1999, section 7.4): the observer's gain is recomputed from the candidate
itself, so a wrong model cannot hide behind the gain of another one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from codegen.predictor import Prediction
from diagnosis.candidate import Candidate
from diagnosis.noise import MAD
from diagnosis.series import Series

Reals = NDArray[np.float64]
BURN_IN = 0.5
"""Seconds at the start of a recording that do not count: the states are being found."""
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
    """A part of the innovations of a `recording`, left out with the others of its `fold`."""

    recording: int
    fold: int
    part: slice


@dataclass(frozen=True)
class Outcome:
    """Innovations of all recordings behind their burn-in, (samples, seen) each.

    Those beyond `limits` (seen,) count in proportion.
    """

    innovations: tuple[Reals, ...]
    predictions: tuple[Prediction, ...] = field(repr=False)
    limits: Reals = field(repr=False)
    is_whole: bool = True

    @cached_property
    def blocks(self) -> list[Block]:
        """The recordings, each cut into `FOLDS` blocks."""
        found = []
        for r, innovation in enumerate(self.innovations):
            edges = np.linspace(0, len(innovation), FOLDS + 1).astype(int).tolist()
            parts = [slice(low, high) for low, high in pairwise(edges)]
            found += [Block(r, (r + k) % FOLDS, part) for k, part in enumerate(parts)]
        return found

    def cost(self) -> float:
        """Return sum over channels of N/2 log(mean square), the negative log likelihood [nats]."""
        if not self.is_whole:
            return np.inf
        return float(np.sum(0.5 * self.counts * np.log(self.variances)))

    @cached_property
    def squares(self) -> list[Reals]:
        """The squares that count (Huber 1964), (samples, seen) for each recording."""
        found = []
        for e in self.innovations:
            near = np.minimum(np.abs(e), self.limits)
            found.append(near * (2.0 * np.abs(e) - near))
        return found

    def robust(self) -> Reals:
        """Return the standard deviation of the innovations by their median (seen,)."""
        return MAD * np.nanmedian(np.abs(np.concatenate(self.innovations)), axis=0)

    @cached_property
    def counts(self) -> Reals:
        """How many innovations each channel has (seen,)."""
        found: Reals = np.sum([np.sum(np.isfinite(e), axis=0) for e in self.innovations], axis=0)
        return found

    @cached_property
    def variances(self) -> Reals:
        """The mean square innovation of each channel (seen,)."""
        squares = np.sum([np.nansum(one, axis=0) for one in self.squares], axis=0)
        found: Reals = np.maximum(squares / np.maximum(self.counts, 1.0), 1e-300)
        return found


def noises_of(series: Sequence[Series], drifts: Mapping[str, float]) -> Noises:
    """Return the noise of the signals and inputs of some recordings: the median over them."""
    seen, inputs = [np.array([one.noise[k] for one in series]) for k in (0, 1)]
    floor = [float(np.nanmax(np.abs(one.measured))) * 1e-6 + 1e-12 for one in series]
    known = np.maximum(np.median(seen, axis=0), np.median(floor))
    return Noises(known, np.median(inputs, axis=0), drifts, np.full(len(known), np.inf))


def burnt(series: Series) -> int:
    """Return how many samples at the start of a recording do not count."""
    return max(1, round(BURN_IN / float(series.period)))


def predicted(
    candidate: Candidate,
    series: Sequence[Series],
    values: Sequence[Mapping[str, float]],
    gains: Gains,
    limits: Reals,
) -> Outcome:
    """Return the innovations of recordings, each with values of its own (per recording)."""
    found = []
    for one, own in zip(series, values, strict=True):
        page = candidate.page(own, one)
        found.append(
            candidate.predictor.predict(
                page,
                one.inputs,
                one.measured,
                gains.first,
                gains.steady,
                candidate.recipe.substeps,
                one.is_linear,
            )
        )
    innovations = tuple(p.innovations[burnt(one) :] for p, one in zip(found, series, strict=True))
    whole = all(p.done == one.count for p, one in zip(found, series, strict=True))
    return Outcome(innovations, tuple(found), limits, whole)
