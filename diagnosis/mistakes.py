"""Mistakes: columns of a recording with a wrong clock or sign, by how well the model foresees it.

Each column is shifted against the others, or turned over; where the model as it is declared
foresees far better then, that is what is wrong with the column. Loads that are not known, wrong
parameters and missing physics make the forecasts worse with and without it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from codegen.build import BuildError
from diagnosis.bench import Bench, balance_drifts
from diagnosis.candidate import Candidate
from diagnosis.estimate import Estimate, looked_at
from diagnosis.finding import Finding
from diagnosis.level import units_of
from diagnosis.point import point_of
from diagnosis.prediction import foreseen_at, noises_of
from diagnosis.series import Reals, Series, compared, paced, pieces_of, require_one_pace
from engine.recording import Recording
from language.document import Document
from language.experiment import Column, RecordingMap
from language.missing import ToolMissing
from language.model import Automaton
from language.problem import SpecError
from language.project import Project

LARGEST_LAG, LAG_STEP = 0.48, 0.04
"""Largest offset of clocks looked for, and the distance of those that are tried [s]."""
LEAST_LAG = 0.1
"""Offsets [s] from which they are a mistake: actuators and sensors lag by less."""
LEAST, LEAST_EACH = 100.0, 0.2
"""Nats that undoing a mistake has to gain in a recording, and nats per sample of it."""
CLEARER = 1.5
"""Times the gain of what is no mistake that it has to gain: of a small lag, of an unused input."""
CLEAR = 1.15
"""The same for another column: a late torque and an early speed look alike."""
MOST = 0.6
"""Share of the recordings that tell of a clock from which it is that of all of them."""
SAME_CLOCK = 0.06
"""Lags nearer than this are one offset [s]."""
SLOW = 0.4
"""Seconds over which the mean of innovations is taken out: what is slow tells no time."""
UNUSED = 1e-6
"""What an input is scaled by, to see whether the model is better off without it; its sign stays."""


@dataclass(frozen=True)
class Trial:
    """A column - the inputs first, then what is compared - set earlier by `lag` [s], or turned
    over (`factor` -1), or an input not used (`factor` 0).
    """

    column: int
    lag: float = 0.0
    factor: int = 1

    @property
    def is_mistake(self) -> bool:
        """Tell whether this is a mistake of the data, not a lag that machines have."""
        return self.factor < 0 or abs(self.lag) >= LEAST_LAG

    def is_like(self, other: Trial) -> bool:
        """Tell whether two of them are the same mistake."""
        near = abs(self.lag - other.lag) <= SAME_CLOCK
        return near and (self.column, self.factor) == (other.column, other.factor)


@dataclass(frozen=True)
class Mistake:
    """What undoes a mistake in one recording or, where it is "", in all."""

    trial: Trial
    recording: str


def mistakes_of(
    document: Document,
    project: Project,
    automaton: Automaton,
    mapping: RecordingMap,
    recordings: Sequence[Recording],
) -> list[Finding] | None:
    """Return the wrong clocks and signs of recordings; None where they cannot be found."""
    seen = compared(mapping, automaton)
    series = [
        one for recording in recordings for one in pieces_of(recording, mapping, automaton, seen)
    ]
    series = list(paced(series, automaton, seen, False))
    drifts = balance_drifts(document, automaton)
    bench = Bench(document, project, automaton, (), tuple(series), seen, drifts)
    try:
        require_one_pace(series)
        found = mistakes_in(bench.candidate(()), series)
    except (SpecError, ToolMissing, BuildError, ValueError, OSError):
        return None
    names = [*automaton.inputs, *seen]
    columns = {column.to or column.compare: column for column in mapping.columns.values()}
    return [_told(columns[names[one.trial.column]], one) for one in found]


def _told(column: Column, one: Mistake) -> Finding:
    called = f"input `{column.name}`" if column.to else f"`{column.name}`"
    if one.trial.factor < 0:
        text = f"{called} has the wrong sign: it moves against what the model gives"
        return Finding("sign", one.recording, column.name, text, "error")
    way = "late" if one.trial.lag > 0.0 else "early"
    text = f"the clock of {called} is {abs(one.trial.lag):.2f} s {way}"
    return Finding("clock_offset", one.recording, column.name, text, "error")


def mistakes_in(candidate: Candidate, series: Sequence[Series]) -> list[Mistake]:
    """Return the mistakes of all recordings, or of single ones."""
    series = [one for one in series if float(one.period) * one.count > 4.0 * LARGEST_LAG]
    if not series:
        return []
    gains = gained(candidate, series)
    needed = [max(LEAST, LEAST_EACH * one.count) for one in series]
    own = [
        _clearest({trial: float(g[k]) for trial, g in gains.items()}, least)
        for k, least in enumerate(needed)
    ]
    whole = {trial: float(np.sum(g[np.isfinite(g)])) for trial, g in gains.items()}
    shared = _clearest(whole, sum(needed)) if len(series) > 1 else None
    telling = [one for one in own if one]
    alike = [one for one in telling if shared and one.is_like(shared)]
    if shared and len(alike) > MOST * len(telling) and len(alike) >= max(2.0, len(series) / 3.0):
        lag = median(one.lag for one in alike)
        return [Mistake(dataclasses.replace(shared, lag=lag), "")]
    named = zip(own, series, strict=True)
    return [Mistake(trial, one.name) for trial, one in named if trial and _is_steady(trial, own)]


def _is_steady(trial: Trial, own: Sequence[Trial | None]) -> bool:
    """Tell whether a column is off alike wherever it is: what differs is rather physics."""
    return all(one.is_like(trial) for one in own if one and one.column == trial.column)


def gained(candidate: Candidate, series: Sequence[Series]) -> Mapping[Trial, Reals]:
    """Return what undoing each mistake gains [nats] in each recording.

    An input that rests in some recordings is not judged: there it has no clock.
    """
    inputs = series[0].inputs.shape[1]
    moving = [k for k in range(inputs) if all(float(s.inputs[:, k].std()) > 0.0 for s in series)]
    seen = range(inputs, inputs + series[0].measured.shape[1])
    inner = [undone(one, Trial(0)) for one in series]
    base = _followed(candidate, inner)
    before = _costs(base, inner)
    count = round(LARGEST_LAG / LAG_STEP)
    lags = [k * LAG_STEP for k in range(-count, count + 1) if k]
    trials = [Trial(k, lag) for k in (*moving, *seen) for lag in lags]
    trials += [Trial(k, factor=-1) for k in (*moving, *seen)]
    trials += [Trial(k, factor=0) for k in moving]
    found = {}
    for trial in trials:
        right = [undone(one, trial) for one in series]
        model = base if trial.factor == 1 else _followed(candidate, right)
        found[trial] = _gain(before, _costs(model, right))
    return found


def undone(series: Series, trial: Trial) -> Series:
    """Return the inner part of a recording as it would be without a mistake.

    The outer `LARGEST_LAG` s are not used, so that there is a value for every lag.
    """
    margin = round(LARGEST_LAG / float(series.period))
    late = round(trial.lag / float(series.period))
    inside = slice(margin, series.count - margin)
    moved = slice(inside.start + late, inside.stop + late)
    factor = trial.factor or UNUSED
    inputs, measured = series.inputs[inside].copy(), series.measured[inside].copy()
    count = inputs.shape[1]
    if trial.column < count:
        inputs[:, trial.column] = factor * series.inputs[moved, trial.column]
    else:
        measured[:, trial.column - count] = factor * series.measured[moved, trial.column - count]
    return dataclasses.replace(series, inputs=inputs, measured=measured)


def _followed(candidate: Candidate, series: Sequence[Series]) -> Estimate:
    """Return the model as it is declared, with drifts that let it follow the recordings."""
    noises = noises_of(series, {})
    noises = dataclasses.replace(noises, drifts=units_of(candidate, series, {}))
    return looked_at(candidate, series, noises, point_of(candidate, len(series), {}))


def _costs(model: Estimate, series: Sequence[Series]) -> Reals:
    """Return the negative log likelihood [nats] of the quick part of each recording."""
    values, found = [model.values(0)] * len(series), []
    (there,) = foreseen_at(model.candidate, series, [values], model.gains, model.noises.limits)
    for one, done, missed, counts in zip(
        series, there.done.tolist(), there.each, there.counts, strict=True
    ):
        quick = _quick(missed, float(one.period))
        spread = np.log(np.maximum(_means(quick**2), 1e-300))
        whole = done == one.count
        found.append(float(np.sum(0.5 * counts * spread)) if whole else np.inf)
    return np.array(found)


def _means(squares: Reals) -> Reals:
    """Return the mean of what is known of each column."""
    if np.isnan(squares).any():
        return np.asarray(np.nanmean(squares, axis=0), dtype=np.float64)
    found: Reals = squares.sum(axis=0) / len(squares)
    return found


def _quick(innovations: Reals, period: float) -> Reals:
    """Return innovations without their slow part."""
    width = max(1, round(SLOW / period))
    known = np.where(np.isfinite(innovations), innovations, 0.0)
    kernel = np.ones(width) / width
    slow = np.array([np.convolve(column, kernel, mode="same") for column in known.T]).T
    found: Reals = innovations - slow
    return found


def _gain(before: Reals, after: Reals) -> Reals:
    """Return the gains; none where the model does not follow a recording one way or the other."""
    known = np.isfinite(before) & np.isfinite(after)
    found = np.where(known, before, 0.0) - np.where(known, after, 0.0)
    return np.where(known, found, -np.inf)


def _clearest(gains: Mapping[Trial, float], needed: float) -> Trial | None:
    """Return the trial that gains most, if it undoes a mistake and nothing small gains as much."""
    best = max(gains, key=lambda one: gains[one])
    if not best.is_mistake or gains[best] < needed:
        return None
    small = max([0.0, *[gain for one, gain in gains.items() if not one.is_mistake]])
    other = max([0.0, *[gain for one, gain in gains.items() if one.column != best.column]])
    return best if gains[best] > max(CLEARER * small, CLEAR * other) else None
