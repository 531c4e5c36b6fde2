"""Evidence: what a model gains over another on the training recordings, and on parts left out.

Every fifth block in time of each recording is left out by influence: the point without them is one
step of the normal equations of the others away (the infinitesimal jackknife, Efron 1982); from
there they are foreseen.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimate import Estimate, outcome_at
from diagnosis.normal import stepped
from diagnosis.point import Point
from diagnosis.prediction import FOLDS, Outcome
from diagnosis.series import Series

Reals = NDArray[np.float64]
PARTS = (1.0, 0.5, 0.25, 0.1)
"""Parts of a step that are tried."""
LAGS = 0.25
"""Seconds over which innovations may hang together."""
MOST_KEPT = 8
"""Models of which what was left out is kept, the latest ones; known by their identity."""


@dataclass(frozen=True)
class Evidence:
    """Gains [nats]: `train` after the price of the parameters, `left_out` over all blocks.

    `each` (recordings,) is what is gained left out in each.
    """

    train: float
    left_out: float
    each: tuple[float, ...]

    @property
    def least(self) -> float:
        """The smaller of the two."""
        return min(self.train, self.left_out)

    @property
    def total(self) -> float:
        """Their sum: what candidates are ranked by."""
        return self.train + self.left_out


Key = tuple[int, tuple[int, ...]]
_kept: OrderedDict[Key, tuple[Estimate, Sequence[Series], Reals]] = OrderedDict()


def evidence(model: Estimate, base: Estimate, series: Sequence[Series]) -> Evidence:
    """Return what a model gains over a base that it extends; one that is unstable loses all."""
    if not np.isfinite(model.cost):
        return Evidence(-np.inf, -np.inf, (-np.inf,) * len(series))
    shrink = 1.0 / inflation(model, series)
    count = float(np.sum(model.outcome.counts))
    more = _free(model, len(series)) - _free(base, len(series))
    price = 0.5 * more * np.log(max(count * shrink, 2.0))
    train = shrink * (base.cost - model.cost) - price
    before, after = _left_out(base, series), _left_out(model, series)
    each = shrink * _gained(before, after, model.outcome.counts)
    return Evidence(float(train), float(np.sum(each)), tuple(float(one) for one in each))


def less(whole: Evidence, parts: Sequence[Evidence]) -> Evidence:
    """Return what is left of a gain when others have theirs."""
    each = zip(whole.each, *(part.each for part in parts), strict=True)
    return Evidence(
        whole.train - sum(part.train for part in parts),
        whole.left_out - sum(part.left_out for part in parts),
        tuple(first - sum(rest) for first, *rest in each),
    )


def more(known: Evidence, gained: Evidence) -> Evidence:
    """Return a gain with what was gained after it."""
    each = zip(known.each, gained.each, strict=True)
    total = tuple(first + second for first, second in each)
    return Evidence(known.train + gained.train, known.left_out + gained.left_out, total)


def inflation(model: Estimate, series: Sequence[Series]) -> float:
    """Return how many innovations count as one: 1 + 2 sum of squared autocorrelations, at least 1.

    (Bartlett 1946, for a quadratic function of them.)
    """
    return _counting_as_one(model.outcome.innovations, float(series[0].period))


def inflations(model: Estimate, series: Sequence[Series]) -> Reals:
    """Return how many innovations of each recording count as one: (recordings,)."""
    period = float(series[0].period)
    return np.array([_counting_as_one([one], period) for one in model.outcome.innovations])


def _counting_as_one(innovations: Sequence[Reals], period: float) -> float:
    lags = max(1, round(LAGS / period))
    found = []
    for channel in range(innovations[0].shape[1]):
        whole = [e[np.isfinite(e[:, channel]), channel] for e in innovations]
        power = sum(float(e @ e) for e in whole)
        total = 1.0
        for lag in range(1, lags + 1) if power > 0.0 else ():
            together = sum(float(e[lag:] @ e[:-lag]) for e in whole if len(e) > lag)
            total += 2.0 * (together / power) ** 2
        found.append(total)
    return float(np.mean(found))


def _free(model: Estimate, recordings: int) -> int:
    return sum(recordings if one.per_recording else 1 for one in model.candidate.uncertain)


def _gained(before: Reals, after: Reals, counts: Reals) -> Reals:
    """Return the gain [nats] in each recording, N/2 log of the ratio of mean squares in all.

    `before` and `after` are sums of squares (recordings, seen). What a recording has of the gain is
    what it has of the difference.
    """
    if not (np.all(np.isfinite(before)) and np.all(np.isfinite(after))):
        return np.full(len(before), np.inf if np.all(np.isfinite(after)) else -np.inf)
    first, second = before.sum(axis=0), after.sum(axis=0)
    apart = first - second
    ratio = np.log(first / second)
    weight = np.where(
        np.abs(ratio) > 1e-12, ratio / np.where(apart == 0.0, 1.0, apart), 1.0 / first
    )
    return np.asarray(0.5 * (before - after) @ (counts * weight), dtype=np.float64)


def _left_out(model: Estimate, series: Sequence[Series]) -> Reals:
    """Return the squares (recordings, seen) of each block at the point that the others ask for.

    What was found of the latest models is kept: a base is asked beside each candidate.
    """
    key = id(model), tuple(id(one) for one in series)
    if key not in _kept:
        _kept[key] = model, series, _left_out_anew(model, series)
        if len(_kept) > MOST_KEPT:
            _kept.popitem(last=False)
    _kept.move_to_end(key)
    return _kept[key][2]


def _left_out_anew(model: Estimate, series: Sequence[Series]) -> Reals:
    found = np.zeros((len(series), len(model.candidate.predictor.seen)))
    if model.normal is None:
        return np.full(found.shape, np.inf)
    for fold in range(FOLDS):
        outcome = _without(model, series, fold)
        if not outcome.is_whole:
            return np.full(found.shape, np.inf)
        found += _squares(outcome, fold, False)
    return found


def _without(model: Estimate, series: Sequence[Series], fold: int) -> Outcome:
    """Return the recordings foreseen from where a model would be without a fold.

    A step that does not do the others any good is shortened: the model is not as linear as that.
    Where not even a tenth of it does, the model stays where it is.
    """
    assert model.normal is not None
    scale = model.outcome.variances
    there = stepped(model.candidate, model.point, model.normal.without(fold), 0.0)
    limit = _kept_cost(model, model.outcome, model.point, fold, scale)
    for part in PARTS:
        point = Point(
            model.point.shared + part * (there.shared - model.point.shared),
            model.point.own + part * (there.own - model.point.own),
        )
        outcome = outcome_at(model, series, point)
        if outcome.is_whole and _kept_cost(model, outcome, point, fold, scale) <= limit:
            return outcome
    return model.outcome


def _kept_cost(model: Estimate, outcome: Outcome, point: Point, fold: int, scale: Reals) -> float:
    """Return the cost [nats] of what is not left out."""
    squares = _squares(outcome, fold, True)
    return 0.5 * float(np.sum(squares.sum(axis=0) / scale)) + point.prior(model.candidate)


def _squares(outcome: Outcome, fold: int, others: bool) -> Reals:
    """Return the sums of squares (recordings, seen) of a fold, or of all others."""
    squares = outcome.squares
    found = np.zeros((len(outcome.parts), squares.shape[1]))
    for block in outcome.blocks:
        if (block.fold != fold) == others:
            found[block.recording] += np.nansum(squares[block.part], axis=0)
    return found
