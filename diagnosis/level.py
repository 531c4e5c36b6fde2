"""Level: how much an unknown disturbance may drift at each place, chosen by likelihood.

A drift of one unit moves a compared signal by its own noise within `REACH` seconds. While effects
are named it is held small: a free one would swallow the physics that is sought.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from diagnosis.candidate import Candidate
from diagnosis.estimate import Estimate, looked_at
from diagnosis.estimation import led
from diagnosis.modes import near, points_of
from diagnosis.point import Point
from diagnosis.prediction import Noises, noises_of
from diagnosis.series import Series
from diagnosis.slopes import Columns
from diagnosis.tuning import FARTHEST, tuned

REACH = 0.2
"""Seconds in which a drift of one unit shows."""
LEVELS = (0.0, 0.1, 0.3, 1.0, 3.0)
"""Standard deviations that a drift may have, in its unit; the last is the most while naming."""
FIRST_LEVELS = (0.1, 0.3, 1.0)
"""Those from which a base is fitted: a fit with much drift does not find its way to less."""
QUIET = FIRST_LEVELS[0]
"""That from which a candidate is fitted as well."""
FAR = 4.0
"""Standard deviations beyond which an innovation counts as that far."""
SCALE = 1.5
"""Factor by which the noise of inputs or of a signal is changed at a time."""
ENOUGH = 2.0
"""Another level is taken where it gains this much [nats]."""


def units_of(
    candidate: Candidate, series: Sequence[Series], start: Mapping[str, float]
) -> dict[str, float]:
    """Return the unit [SI] of each drift of a candidate, for the noise that was measured."""
    seen_noise = noises_of(series, {}).seen
    mode, seen_there = next(iter(points_of(candidate, series, None).items()))
    page = candidate.page(start, series[0])
    linear = near(candidate, page, mode, seen_there.states, seen_there.inputs)
    if linear is None:
        raise ValueError("the base is unstable where the first recording starts")
    count = max(1, round(REACH / float(series[0].period)))
    ahead = linear.c @ np.linalg.matrix_power(linear.phi, count)
    found = {}
    for name in candidate.drifts:
        seen = np.abs(ahead[:, candidate.predictor.states.index(name)]) / seen_noise
        found[name] = 1.0 / max(float(np.max(seen)), 1e-12)
    return found


def levelled(
    now: Estimate,
    series: Sequence[Series],
    units: Mapping[str, float],
) -> Estimate:
    """Return an estimate with the drifts that the recordings ask for, its parameters held.

    Only drifts that have a unit are moved. What is known of the noise of inputs and signals is
    known to a factor only: with a gain that is not the best, anything would seem to gain.
    """
    for name in units:
        here = _place(now.noises.drifts.get(name, 0.0), units[name])
        for direction in (1, -1):
            while 0 <= here + direction < len(LEVELS):
                drifts = {**now.noises.drifts, name: LEVELS[here + direction] * units[name]}
                noises = dataclasses.replace(now.noises, drifts=drifts)
                tried = looked_at(now.candidate, series, noises, now.point, now.outcome)
                if not tried.cost < now.cost - ENOUGH:
                    break
                now, here = tried, here + direction
    return _scaled_noises(now, series)


def _scaled_noises(now: Estimate, series: Sequence[Series]) -> Estimate:
    """Return an estimate with the noise of its inputs, then of each signal, scaled.

    Not far from what was measured: a model that lacks something would trust in its signals alone.
    """
    known = noises_of(series, {})
    for place in range(-1, len(now.noises.seen)):
        for factor in (SCALE, 1.0 / SCALE):
            noises = _scaled(now.noises, place, factor)
            while _is_near(noises, known, place):
                tried = looked_at(now.candidate, series, noises, now.point, now.outcome)
                if not tried.cost < now.cost - ENOUGH:
                    break
                now, noises = tried, _scaled(noises, place, factor)
    return now


def _is_near(noises: Noises, known: Noises, place: int) -> bool:
    """Tell whether the noise of the inputs (-1) or of a signal is near what was measured."""
    now, measured = (
        (noises.inputs, known.inputs) if place < 0 else (noises.seen[place], known.seen[place])
    )
    ratio = np.max(now / np.maximum(measured, 1e-300), initial=0.0, where=np.asarray(measured) > 0)
    return bool(1.0 / FARTHEST <= ratio <= FARTHEST)


def _scaled(noises: Noises, place: int, factor: float) -> Noises:
    """Return noises with that of the inputs (-1) or of a signal by its place scaled."""
    if place < 0:
        return dataclasses.replace(noises, inputs=factor * noises.inputs)
    seen = noises.seen.copy()
    seen[place] *= factor
    return dataclasses.replace(noises, seen=seen)


def settled(
    candidate: Candidate,
    series: Sequence[Series],
    noises: Noises,
    start: Mapping[str, float] | Point,
    units: Mapping[str, float],
    columns: Columns | None = None,
    like: Estimate | None = None,
) -> Estimate:
    """Return parameters and levels found together, from levels that fit where parameters lead.

    `columns` are slopes of the candidate near the start, `like` a model near it, if there are such.
    """
    now = led(candidate, series, noises, start, known=columns, like=like)
    return tuned(levelled(now, series, units), series, units)


def fitted(
    candidate: Candidate,
    series: Sequence[Series],
    noises: Noises,
    start: Mapping[str, float] | Point,
    units: Mapping[str, float],
    known: float = -np.inf,
    columns: Columns | None = None,
    like: Estimate | None = None,
) -> Estimate:
    """Return a fit with next to no drift at first, or a better one with those that `noises` has.

    What a model explains it has to explain without drifts; a fit with much does not find there.
    The other one is tried where the first does not come below a `known` cost [nats].
    """
    quiet = {**noises.drifts, **{name: QUIET * unit for name, unit in units.items()}}
    still = dataclasses.replace(noises, drifts=quiet)
    first = settled(candidate, series, still, start, units, columns, like)
    is_quiet = all(noises.drifts.get(name, 0.0) <= quiet[name] for name in units)
    if is_quiet or first.cost < known:
        return first
    second = settled(candidate, series, noises, start, units, columns, like)
    return min(first, second, key=lambda one: one.cost)


def first_fit(
    candidate: Candidate, series: Sequence[Series], units: Mapping[str, float]
) -> Estimate:
    """Return the base fitted once to recordings from where it is declared.

    How far innovations usually are out, beyond which they count no more, is known after it.
    """
    first = settled(candidate, series, noises_of(series, units), {}, units)
    limits = FAR * np.maximum(first.outcome.robust(), 1e-12)
    return dataclasses.replace(first, noises=dataclasses.replace(first.noises, limits=limits))


def recalibrated(first: Estimate, series: Sequence[Series], units: Mapping[str, float]) -> Estimate:
    """Return the base fitted to recordings from a first fit, with drifts from little to much, until
    two come to rest alike.
    """
    found: list[Estimate] = []
    for level in FIRST_LEVELS:
        if len(found) > 1 and abs(found[-1].cost - found[-2].cost) < ENOUGH:
            break
        drifts = {name: level * unit for name, unit in units.items()}
        known = dataclasses.replace(first.noises, drifts=drifts)
        near = min(found, key=lambda one: one.cost, default=first)
        start, columns = near.point, near.columns
        found.append(settled(first.candidate, series, known, start, units, columns, near))
    return min(found, key=lambda one: one.cost)


def _place(value: float, unit: float) -> int:
    return int(np.argmin([abs(level - value / unit) for level in LEVELS]))
