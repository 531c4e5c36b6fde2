"""Prediction: how well a candidate foresees recordings, one sample ahead, by its observer.

Innovations form (Ljung 1999, section 7.4): the observer's gain is recomputed from the candidate
itself, so a wrong model cannot hide behind the gain of another one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from codegen.predictor import Prediction
from diagnosis.candidate import Candidate
from diagnosis.linear import Linear, linearised
from diagnosis.noise import MAD
from diagnosis.series import Series

Reals = NDArray[np.float64]
BURN_IN = 0.5
"""Seconds at the start of a recording that do not count: the states are being found."""
SHORT_STAY = 5
"""Samples: a mode that is left sooner has the gain of the mode that lasts longest."""
START_PART = 0.01
"""Standard deviation of a state at the start, as a part of its range."""
KEPT = 0.999
"""Part of itself that an integral keeps over a sample, and what decays does not."""
FOLDS = 5
"""Parts of the recordings that are left out in turn: every fifth block in time of each."""
SMALL = 1e-5
"""Change of a state for a difference, as a part of its range."""
MODEL_NOISE = 1e-7
"""Process noise of every state per sample, as a part of its range: no gain is ever quite 0."""


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


def gains_of(
    candidate: Candidate,
    series: Sequence[Series],
    values: Mapping[str, float],
    noises: Noises,
    outcome: Outcome | None = None,
) -> Gains:
    """Return the gains of a candidate at `values`, near where `outcome` saw each mode.

    Delays are left out of them: what is shown late would seem to know nothing of the states. In
    another mode than the one that lasts longest the gain is that at the usual length of a stay,
    which began with what was known before: in a gap it would never be steady.
    """
    prompt = dict.fromkeys(candidate.recipe.delays, 0.0)
    page = candidate.page({**values, **prompt}, series[0])
    period = float(series[0].period)
    count = burnt(series[0])
    modes = candidate.predictor.modes
    points = points_of(candidate, series, outcome)
    found: dict[int, Reals] = {}
    first = np.zeros((0, len(candidate.spans), len(noises.seen)))
    before = np.zeros(0)
    for mode, point in points.items():
        linear = near(candidate, page, mode, point.states, point.inputs)
        if linear is None:
            continue
        unsure = np.where(_turns(candidate, linear), 0.0, candidate.spans)
        q = _process_noise(candidate, linear, noises, period, unsure)
        given = linear.phi, linear.c, q, noises.seen**2
        if found:
            gains = candidate.predictor.gains(*given, before, 0, point.stay)
        else:
            start = np.diag((START_PART * unsure) ** 2)
            gains = candidate.predictor.gains(*given, start, count)
        if gains is not None:
            first, before = (first, before) if found else (gains[0], gains[2])
            found[mode] = gains[1]
    nothing = np.zeros((len(candidate.spans), len(noises.seen)))
    usual = next(iter(found.values()), nothing)
    steady = np.array([nothing if noises.is_alone else found.get(mode, usual) for mode in modes])
    return Gains(first, np.ascontiguousarray(steady))


def near(
    candidate: Candidate, page: Reals, mode: int, states: Reals, inputs: Reals
) -> Linear | None:
    """Return a candidate over one sample, linearised in a mode near a point; None if unstable."""
    substeps, sizes = candidate.recipe.substeps, SMALL * candidate.spans
    return linearised(candidate.predictor, page, mode, substeps, states, inputs, sizes)


def _turns(candidate: Candidate, linear: Linear) -> NDArray[np.bool_]:
    """Tell which states (states,) are an effect's integrals, such as an angle.

    What such a one shows changes its sign as it turns: a gain made at one angle would be wrong.
    """
    keeps = np.diag(linear.phi) > KEPT
    return np.asarray(keeps & np.array(candidate.recipe.brought), dtype=np.bool_)


def _process_noise(
    candidate: Candidate, linear: Linear, noises: Noises, period: float, unsure: Reals
) -> Reals:
    """Return Q: the noise of the inputs, of the drifts, and next to none of what is `unsure`."""
    q = linear.b @ np.diag(noises.inputs**2) @ linear.b.T
    q = q + np.diag((MODEL_NOISE * unsure) ** 2)
    for name, memory in zip(candidate.drifts, candidate.recipe.memories, strict=True):
        place = candidate.predictor.states.index(name)
        kept = np.exp(-period / memory)
        q[place, place] = noises.drifts.get(name, 0.0) ** 2 * (1.0 - kept**2)
    return q


@dataclass(frozen=True)
class Seen:
    """Where a mode was seen: `states` and `inputs` there, and the usual `stay` in it [samples]."""

    states: Reals
    inputs: Reals
    stay: int


def points_of(
    candidate: Candidate, series: Sequence[Series], outcome: Outcome | None
) -> dict[int, Seen]:
    """Return where each mode was seen, in its longest stay; the mode with the longest first.

    Where the first compared signal is largest: friction is steep near rest alone.
    """
    if outcome is None:
        return _first_seen(candidate, series[0])
    stays: dict[int, list[int]] = {}
    longest: dict[int, Seen] = {}
    for one, prediction in zip(series, outcome.predictions, strict=True):
        modes = prediction.modes[: prediction.done]
        edges = [0, *(np.flatnonzero(np.diff(modes)) + 1).tolist(), len(modes)]
        for low, high in pairwise(edges if len(modes) else [0]):
            mode, stay = int(modes[low]), high - low
            if stay >= SHORT_STAY and stay > max(stays.get(mode, [0])):
                k = _away(one.measured, low, high)
                longest[mode] = Seen(prediction.states[k].copy(), one.inputs[k].copy(), stay)
            stays.setdefault(mode, []).append(stay)
    ordered = sorted(longest, key=lambda mode: -longest[mode].stay)
    usual = {mode: round(float(np.median(stays[mode]))) for mode in ordered}
    return {mode: replace(longest[mode], stay=max(1, usual[mode])) for mode in ordered}


def _first_seen(candidate: Candidate, series: Series) -> dict[int, Seen]:
    """Return where a recording starts."""
    predictor = candidate.predictor
    page = candidate.page({}, series)
    none = np.zeros((len(predictor.modes), len(predictor.states), len(predictor.seen)))
    short, measured = series.inputs[:2].copy(), series.measured[:2].copy()
    run = predictor.predict(page, short, measured, none[:0], none, candidate.recipe.substeps, False)
    return {int(run.modes[0]): Seen(run.states[0].copy(), short[0], 1)}


def _away(measured: Reals, low: int, high: int) -> int:
    """Return the sample of a stay, not near its ends, at which the first signal is largest."""
    margin = (high - low) // 5
    inner = np.abs(measured[low + margin : high - margin, 0])
    known = np.where(np.isfinite(inner), inner, -1.0)
    return low + margin + int(np.argmax(known)) if len(known) else (low + high) // 2
