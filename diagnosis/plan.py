"""Plan: the manoeuvre that would tell candidates apart - each drives it, the other foresees it.

What one candidate would show is foreseen by another, with its observer and its parameters moved as
far as the recordings that there are let them: half the squares that remain, over its innovations'
variances, are the nats by which the first would be preferred.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from diagnosis.bench import Bench
from diagnosis.estimate import Estimate
from diagnosis.evidence import inflation
from diagnosis.manoeuvre import Manoeuvre, manoeuvres_of
from diagnosis.point import Point, point_of
from diagnosis.prediction import Gains, predicted
from diagnosis.series import Series
from diagnosis.slopes import STEP

Reals = NDArray[np.float64]
MOST = 3
"""Candidates that are told apart pair by pair."""
ENOUGH = 20.0
"""Nats below which a manoeuvre would tell nothing."""


@dataclass(frozen=True)
class Option:
    """A manoeuvre with the nats by which it would tell the two nearest candidates apart, and what
    each candidate would show: `shown` (samples, seen) in the order of the plan's names.
    """

    manoeuvre: Manoeuvre
    nats: float
    shown: tuple[Reals, ...] = field(repr=False)


@dataclass(frozen=True)
class Plan:
    """Candidates by name, and the options, the best first."""

    names: tuple[str, ...]
    options: tuple[Option, ...]

    @property
    def tells(self) -> bool:
        """Whether the best manoeuvre would tell the candidates apart."""
        return bool(self.options) and self.options[0].nats >= ENOUGH

    def sentence(self) -> str:
        """Return what to record, in one sentence."""
        names = " from ".join((self.names[0], " and ".join(self.names[1:])))
        if not self.tells:
            return f"no manoeuvre that was tried would tell {names}"
        best = self.options[0]
        return (
            f"to tell {names}, record: {best.manoeuvre.name} "
            f"({best.nats:.0f} nats expected, {ENOUGH:.0f} are enough)"
        )


def planned(bench: Bench, candidates: Sequence[tuple[str, Estimate]]) -> Plan | None:
    """Return the plan for two or more fitted candidates; None where nothing can be planned."""
    some = list(candidates)[:MOST]
    if len(some) < 2:
        return None
    options = []
    for manoeuvre in manoeuvres_of(bench):
        shown = [_alone(model, manoeuvre.series) for _, model in some]
        if any(one is None for one in shown):
            continue
        runs = [one for one in shown if one is not None]
        nats = [
            _told(model, bench.series, manoeuvre.series, run)
            for k, (_, model) in enumerate(some)
            for j, run in enumerate(runs)
            if j != k
        ]
        options.append(Option(manoeuvre, min(nats), tuple(runs)))
    options.sort(key=lambda option: -option.nats)
    return Plan(tuple(name for name, _ in some), tuple(options)) if options else None


def _alone(model: Estimate, series: Series) -> Reals | None:
    """Return what a model shows of a manoeuvre (samples, seen); None where it does not run."""
    gains = Gains(model.gains.first[:0], np.zeros_like(model.gains.steady))
    run = predicted(model.candidate, [series], [model.values(0)], gains, model.noises.limits)
    return run.predictions[0].seen if run.is_whole else None


def _told(model: Estimate, recorded: Sequence[Series], series: Series, shown: Reals) -> float:
    """Return the nats by which a model would fail to foresee what another one shows."""
    record = dataclasses.replace(series, measured=np.ascontiguousarray(shown))
    point = point_of(model.candidate, 1, model.values(0))
    before = _innovations(model, record, point)
    if before is None:
        return 0.0
    columns = []
    for k in range(len(model.candidate.uncertain)):
        ahead = point.moved(model.candidate, k, STEP)
        size = float(ahead.shared[k] - point.shared[k])
        after = _innovations(model, record, ahead)
        columns.append(np.zeros_like(before) if after is None else (after - before) / size)
    normal = model.normal
    assert normal is not None
    known = np.eye(len(columns))
    shared = ~normal.own
    known[np.ix_(shared, shared)] += np.sum(normal.a, axis=0)[np.ix_(shared, shared)]
    jacobian = np.stack(columns, axis=1)
    right = jacobian.T @ before
    moved = np.linalg.solve(known + jacobian.T @ jacobian, right)
    shrink = 1.0 / inflation(model, recorded)
    return 0.5 * shrink * float(before @ before - right @ moved)


def _innovations(model: Estimate, record: Series, point: Point) -> Reals | None:
    """Return the innovations over their standard deviations (samples * seen,)."""
    values = {
        one.name: one.value(float(point.shared[k]))
        for k, one in enumerate(model.candidate.uncertain)
    }
    run = predicted(model.candidate, [record], [values], model.gains, model.noises.limits)
    if not run.is_whole:
        return None
    size = np.sqrt(model.outcome.variances)
    return np.asarray((run.innovations[0] / size).reshape(-1), dtype=np.float64)
