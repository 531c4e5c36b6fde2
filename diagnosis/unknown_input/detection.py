"""Unknown input: a force or torque that acts in windows, such as a brake or an impact.

It is found as a free disturbance in a balance. As that explains anything, it must be small most of
the time and independent of what is known. An input that is free everywhere also absorbs the error
of a wrong mass or drag, so parameters are estimated where it does not act.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from diagnosis.criterion.effective_sample_size import autocorrelation_sum
from diagnosis.criterion.threshold import Thresholds
from diagnosis.data.array_types import Reals
from diagnosis.data.noise_estimate import MAD_TO_STD
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.data.stacked_recordings import burn_in_samples
from diagnosis.estimation.estimate import Estimate, evaluate, with_normal_equations
from diagnosis.estimation.levenberg_marquardt import estimate_parameters
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import ORDINARY_LEVEL, disturbance_units
from diagnosis.localisation.disturbance_state_fit import (
    ALL_LEVELS,
    scan_level,
    with_disturbance_levels,
)
from diagnosis.localisation.location import (
    DisturbanceEstimate,
    Location,
    with_disturbances,
    with_smoothed_disturbances,
)
from diagnosis.localisation.ranking import localise
from diagnosis.model.parameter_vector import ParameterVector
from diagnosis.model.placed_effect import PlacedEffect, find_placements
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.forward_selection import Selection
from diagnosis.selection.intersample import LogCallback
from diagnosis.unknown_input.dependence import input_dependence, standstill_dependence

Booleans = NDArray[np.bool_]
ENERGY_FRACTION = 0.8
"""Part of the squares of a disturbance that its largest samples have."""
GAUSSIAN_FRACTION, GAUSSIAN_FRACTION_STD = 0.316, 0.286
"""Part of the samples of a normal disturbance that these are, and its standard deviation for one
independent sample."""
SURE_STDS = 2.33
"""Standard deviations by which the part must be smaller for an input that acts in windows: 1 % of
normal processes seem to do so."""
MEMORY = 10.0
"""Reference times up to which the samples of a disturbance are correlated."""
NEAR_BEST_FRACTION = 0.9
"""Part of the largest gain of a place from which another one may be that of the input."""
MAX_EXPLAINED_SHARE = 0.5
"""Share of the remainder that an effect explains above which the remainder is no separate input."""
MAX_CORRELATION = 0.6
"""Correlation with a known quantity above which a disturbance is no unknown input."""
MAX_INPUT_DEPENDENCE = 0.4
"""Correlation of its amplitude with the movement of known inputs above which it is a response."""
MAX_STANDSTILL_DEPENDENCE = 0.7
"""Correlation of its amplitude with standstill above which it is an error of a friction."""
MARGIN = 2.5
"""Reference times before and after an active interval that do not count as inactive."""
MIN_DURATION = 10.0
"""Shortest inactive interval, in reference times; the observer must find the states in it."""
MIN_INACTIVE_FRACTION = 1.0 / 3.0
"""Smallest fraction of the samples that is inactive, for parameters to follow from it."""


def detect_unknown_input(
    model_set: ModelSet,
    selection: Selection,
    locations: Sequence[Location],
    thresholds: Thresholds,
    log: LogCallback = lambda text: None,
) -> tuple[Selection, tuple[Location, ...]]:
    """Return the selection with an unknown input, and the locations with its time course.

    It is tried at the balances whose free disturbances gain most. It must gain its threshold and
    more than a negligible energy. Beside accepted effects more than an ordinary
    disturbance must be left, of which no effect explains half. The selection and the locations are
    returned unchanged if the disturbance does not act in windows.
    """
    effects = _unknown_input_effects(model_set)
    if not effects or not _leaves_an_input(selection):
        return selection, tuple(locations)
    remaining = localise(model_set, selection.model) if selection.accepted else tuple(locations)
    place = _find_place(model_set, remaining, effects)
    if place is None:
        return selection, tuple(locations)
    placed_effect = effects[place.path]
    gain = place.gain / selection.last.correlation
    if gain < thresholds.threshold_of(placed_effect) + selection.last.negligible_gain:
        return selection, tuple(locations)
    assert place.free_model is not None
    refitted = _refit_on_inactive_intervals(model_set, place, place.free_model)
    assert refitted.free_model is not None
    log(f"accepted {placed_effect.id}: inactive most of the time")
    model = with_normal_equations(refitted.free_model, model_set.series)
    hidden = CandidateFit(placed_effect, gain, model, gain, 1.0)
    selection = dataclasses.replace(
        selection, model=model, accepted=(*selection.accepted, hidden), rivals=()
    )
    return selection, (refitted, *(one for one in locations if one.path != place.path))


def _leaves_an_input(selection: Selection) -> bool:
    """Return whether a selection leaves enough for an unknown input."""
    last = selection.last
    if not selection.accepted:
        return True
    explained = max((one.share for one in last.candidates if one.gain > 0.0), default=0.0)
    return not last.is_ordinary and explained <= MAX_EXPLAINED_SHARE


def _find_place(
    model_set: ModelSet, locations: Sequence[Location], effects: Mapping[str, PlacedEffect]
) -> Location | None:
    """Return the first balance of nearly the largest gain with an unknown input, smoothed."""
    most = max((one.gain for one in locations), default=0.0)
    for one in locations:
        if one.path in effects and one.gain > NEAR_BEST_FRACTION * most:
            smoothed = with_smoothed_disturbances(model_set, one)
            if _is_unknown_input(model_set, smoothed):
                return smoothed
    return None


def _is_unknown_input(model_set: ModelSet, location: Location) -> bool:
    """Return whether the disturbance at a place acts in windows and depends on nothing known."""
    values = [one.values for one in location.disturbances]
    follows = any(abs(r) > MAX_CORRELATION for _, r in location.correlates)
    lags = round(float(np.median([one.sample_count(MEMORY) for one in model_set.series])))
    if follows or not is_intermittent(values, lags):
        return False
    return (
        input_dependence(model_set.series, values) < MAX_INPUT_DEPENDENCE
        and standstill_dependence(model_set.series, values) < MAX_STANDSTILL_DEPENDENCE
    )


def _refit_on_inactive_intervals(
    model_set: ModelSet, location: Location, free_model: Estimate
) -> Location:
    """Return a location with parameters fitted where the input does not act.

    The intervals are those outside the largest values, then those without a significant value, if
    that costs less. The standard deviation is at least the size in inactive intervals.
    """
    least = _energy_level([one.values for one in location.disturbances])
    is_inactive = [np.abs(one.values) < least for one in location.disturbances]
    series, state = model_set.series, location.disturbance_state
    active = [~one for one in is_inactive]
    free_model = _fit_outside_active(free_model, series, active, state)
    location = _with_free_model(model_set, location, free_model)
    active = [one.is_significant for one in location.disturbances]
    again = _fit_outside_active(free_model, series, active, state)
    if again.cost < free_model.cost:
        location = _with_free_model(model_set, location, again)
    pairs = zip(location.disturbances, is_inactive, strict=True)
    ratios = np.concatenate([np.abs(one.values / one.stds)[rows] for one, rows in pairs])
    scale = max(1.0, MAD_TO_STD * float(np.median(ratios)))
    wider = (DisturbanceEstimate(one.values, scale * one.stds) for one in location.disturbances)
    return with_disturbances(model_set, location, tuple(wider))


def _fit_outside_active(
    model: Estimate, series: Sequence[SampledRecording], active: Sequence[Booleans], name: str
) -> Estimate:
    """Return a model with the disturbance `name` free, fitted on its inactive intervals.

    `active` (samples,) of each recording begins after its burn-in. The model is returned unchanged
    if the intervals are too short.
    """
    pieces, places = _inactive_recordings(series, active)
    if sum(one.count for one in pieces) < MIN_INACTIVE_FRACTION * sum(one.count for one in series):
        return model
    units = disturbance_units(model.candidate, series, model.values(0))
    recording_indices = [places.index(r) if r in places else 0 for r in range(len(series))]
    start = ParameterVector(model.point.shared, model.point.per_recording[places])
    ordinary = with_disturbance_levels(
        model.noise_levels, units, dict.fromkeys(units, ORDINARY_LEVEL)
    )
    best = estimate_parameters(model.candidate, pieces, ordinary, start)
    point = ParameterVector(best.point.shared, best.point.per_recording[recording_indices])
    free = evaluate(model.candidate, series, ordinary, point)
    return scan_level(free, series, units, name, ALL_LEVELS)


def _inactive_recordings(
    series: Sequence[SampledRecording], active: Sequence[Booleans]
) -> tuple[list[SampledRecording], list[int]]:
    """Return inactive intervals, the longest first, and the index of their recordings."""
    found = []
    for r, (one, there) in enumerate(zip(series, active, strict=True)):
        around = np.ones(2 * one.sample_count(MARGIN) + 1)
        whole = np.pad(there, (burn_in_samples(one), 0)).astype(float)
        near = np.convolve(whole, around, "same") > 0.5
        found += [(part, r) for part in _inactive_parts(one, near)]
    found.sort(key=lambda pair: -pair[0].count)
    return [part for part, _ in found], [r for _, r in found]


def _inactive_parts(series: SampledRecording, active: Booleans) -> list[SampledRecording]:
    """Return the inactive parts of a recording; each begins where all outputs are measured."""
    edges = [0, *(np.flatnonzero(np.diff(active)) + 1).tolist(), series.count]
    known = np.flatnonzero(np.all(np.isfinite(series.measured), axis=1))
    found = []
    for low, high in pairwise(edges):
        first = known[np.searchsorted(known, low) :][:1]
        if not active[low] and len(first) and high - first[0] >= series.sample_count(MIN_DURATION):
            part = slice(int(first[0]), high)
            found.append(
                dataclasses.replace(
                    series,
                    start=series.start + series.period * part.start,
                    inputs=np.ascontiguousarray(series.inputs[part]),
                    measured=np.ascontiguousarray(series.measured[part]),
                )
            )
    return found


def _with_free_model(model_set: ModelSet, location: Location, free_model: Estimate) -> Location:
    """Return a location with another fit and its smoothed disturbance."""
    location = dataclasses.replace(location, free_model=free_model, disturbances=())
    return with_smoothed_disturbances(model_set, location)


def is_intermittent(disturbances: Sequence[Reals], lags: int) -> bool:
    """Return whether a disturbance is small for longer than a normal process is by chance.

    Its samples are correlated up to `lags`. A normal process that is as correlated has most of its
    squares in about a third of the time.
    """
    whole = np.abs(np.concatenate(disturbances))
    correlation = autocorrelation_sum([one[:, np.newaxis] for one in disturbances], lags)
    spread = GAUSSIAN_FRACTION_STD * math.sqrt(correlation / len(whole))
    least = GAUSSIAN_FRACTION - SURE_STDS * spread
    return bool(np.mean(whole >= _energy_level(disturbances)) < least)


def _energy_level(disturbances: Sequence[Reals]) -> float:
    """Return the amount from which on the samples of a drift have most of its squares."""
    falling = np.sort(np.abs(np.concatenate(disturbances)))[::-1]
    whole = np.cumsum(falling**2)
    return float(falling[np.searchsorted(whole, ENERGY_FRACTION * whole[-1])])


def _unknown_input_effects(model_set: ModelSet) -> dict[str, PlacedEffect]:
    """Return, by path, the inputs without parameters that the library knows for balances."""
    balances = {drift.place for drift in model_set.disturbances}
    return {
        f"flow.{one.place}": one
        for effect in model_set.effects
        if effect.body.get("parameters") is None
        for one in find_placements(model_set.document, effect)
        if one.place in balances
    }
