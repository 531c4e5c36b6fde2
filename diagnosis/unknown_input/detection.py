"""Unknown input: detection of a force or torque that acts in windows, such as a brake or an impact.

It is found as a free disturbance in a balance. Because that explains anything without parameters,
it is accepted only if it is small most of the time.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.criterion.effective_sample_size import integrated_autocorrelation
from diagnosis.criterion.likelihood_gain import LikelihoodGain, likelihood_gain
from diagnosis.criterion.recording_support import supported_gain
from diagnosis.criterion.threshold import DEFAULT_THRESHOLD, Thresholds
from diagnosis.data.array_types import Reals
from diagnosis.data.noise_estimate import MAD_TO_STD
from diagnosis.estimation.estimate import Estimate, evaluate, with_normal_equations
from diagnosis.estimation.levenberg_marquardt import iterate_broyden
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import disturbance_units
from diagnosis.localisation.cause import balance_of
from diagnosis.localisation.disturbance_state_fit import (
    ALL_LEVELS,
    SMALL_LEVEL,
    free_disturbance,
    scan_level,
    with_disturbance_levels,
)
from diagnosis.localisation.location import (
    DisturbanceEstimate,
    Location,
    with_disturbances,
    with_smoothed_disturbances,
)
from diagnosis.model.parameter_vector import extend_vector
from diagnosis.model.placed_effect import PlacedEffect, find_placements, place_path
from diagnosis.selection.candidate_search import CandidateFit, LogCallback
from diagnosis.selection.forward_selection import MIN_GAIN_RATIO, Selection, select_effects
from diagnosis.unknown_input.dependence import input_dependence, standstill_dependence
from diagnosis.unknown_input.inactive_interval import refit_on_inactive_intervals
from diagnosis.validation.adequacy import has_autocorrelated_residuals

ENERGY_FRACTION = 0.8
"""Part of the squares of a drift that its loudest samples have."""
MAX_ACTIVE_FRACTION = 0.22
"""Part of all samples that these are at most, of what acts in windows."""
MAX_CORRELATION = 0.6
"""Correlation with something known from which on an input is not hidden: it follows that. A brake
acts where the motor brakes as well: the LEAF's has 0.52."""
MAX_INPUT_DEPENDENCE = 0.4
"""Correlation of its loudness with the movement of known inputs from which on it is an answer."""
MAX_STANDSTILL_DEPENDENCE = 0.7
"""Correlation of its loudness with rest from which on it is what a friction lacks."""
NEAR_BEST_FRACTION = 0.9
"""Part of what the best place gains that another one gains nearly the same with."""
MAX_EXPLAINED_FRACTION = 0.5
"""Part of what it gains that effects explain less of, if it is to stand for them."""
EFFECTS_FIRST_FACTOR = 3.0
"""Times what a hidden input gains that effects explain which are named before it."""
SINGLE_RECORDING_FACTOR = 3.0
"""Times what it needs to gain that an input must gain which acts in one recording alone."""
MAX_ITERATIONS = 5
"""Rounds in which what was accepted is fitted without drifts."""


@dataclass(frozen=True)
class _UnknownInput:
    """An input that acts in windows at a place: a model in which it is free beside `effects`, and
    what it `gained` [nats] over these. `explained` is what they had gained before it was found.
    """

    location: Location
    model: Estimate
    effects: tuple[CandidateFit, ...]
    gain: float
    likelihood_gain: LikelihoodGain
    explained: float = 0.0


def _supported_gain(gain: LikelihoodGain) -> float:
    """Return what an input gains [nats] as it counts: it may act in one recording alone."""
    return supported_gain(gain, single_recording_factor=SINGLE_RECORDING_FACTOR)


def detect_unknown_input(
    model_set: ModelSet,
    selection: Selection,
    locations: Sequence[Location],
    min_gain: float,
    log: LogCallback = lambda text: None,
) -> tuple[Selection, tuple[Location, ...]]:
    """Return the selection with an unknown input, and the locations with its time course.

    It replaces effects that explain less, and follows those that explain more. Gains are relative
    to a model without disturbances. If none gains `min_gain` [nats], both arguments are returned
    unchanged.
    """
    found = _find_unknown_input(model_set, selection, locations, min_gain)
    if found is None or _supported_gain(found.likelihood_gain) < min_gain:
        return selection, tuple(locations)
    placed_effect, without_drifts = (
        _unknown_input_effects(model_set)[found.location.path],
        free_disturbance(model_set, selection.base),
    )
    gained = f"accepted {placed_effect.id}: {_supported_gain(found.likelihood_gain):.0f} nats"
    beside = f", beside effects that explain {found.explained:.0f}" if found.effects else ""
    log(f"{gained}, inactive most of the time{beside}")
    place = _refit_on_inactive_intervals(model_set, found.location, found.model)
    assert place.free_model is not None
    model = with_normal_equations(place.free_model, model_set.series)
    others = (one for one in locations if one.path != place.path)
    hidden = CandidateFit(placed_effect, found.gain, model, found.likelihood_gain)
    known = selection.first_round
    is_less = _follows_effects(model_set, found)
    selection = dataclasses.replace(
        selection,
        base=without_drifts,
        model=model,
        accepted=(*found.effects, hidden) if is_less else (hidden, *found.effects),
        first_round=known if is_less else (hidden, *known),
        rivals=(),
    )
    return selection, (place, *others)


def _follows_effects(model_set: ModelSet, unknown_input: _UnknownInput) -> bool:
    """Tell whether effects are named before a hidden input: they gain more beside the drifts of
    the base, explain much more than it where nothing drifts, or one acts at its place. What it
    explains there is then what the form of that one does not.
    """
    gained = sum(
        one.likelihood_gain.penalised for one in unknown_input.effects if one.likelihood_gain
    )
    if (
        gained > _supported_gain(unknown_input.likelihood_gain)
        or unknown_input.explained > EFFECTS_FIRST_FACTOR * unknown_input.gain
    ):
        return True
    places = (place_path(one.placed_effect).partition(".") for one in unknown_input.effects)
    return any(
        balance_of(model_set, section, place) == unknown_input.location.path
        for section, _, place in places
    )


def _find_unknown_input(
    model_set: ModelSet, selection: Selection, locations: Sequence[Location], min_gain: float
) -> _UnknownInput | None:
    """Return an input that acts in intervals, at one of the places with a large gain; or None.

    Alone it must gain nearly as much as any other place, such as the inside of a shaft. Of two with
    nearly the same gain, the one that is inactive most of the time is preferred. If none is, an
    input beside the accepted effects is tried, unless their residuals are autocorrelated.
    """
    may_join = not has_autocorrelated_residuals(model_set, selection)
    shrink = 1.0 / integrated_autocorrelation(selection.base, model_set.series)
    known = _unknown_input_effects(model_set)
    loud = [one for one in locations if one.path in known and shrink * one.gain > min_gain]
    near = [one for one in loud if one.gain > NEAR_BEST_FRACTION * loud[0].gain]
    most = max((one.gain for one in locations), default=0.0)
    for location in near:
        found = with_smoothed_disturbances(model_set, location)
        if not _is_unknown_input(model_set, found):
            continue
        alone = _without_effects(model_set, selection, found)
        if alone is None:
            return _beside_effects(model_set, selection, found) if may_join else None
        if location.gain > NEAR_BEST_FRACTION * most:
            return _add_effects(model_set, selection, alone)
    for location in near if selection.accepted and may_join else ():
        if _may_gain(model_set, selection.model, location.disturbance_state, min_gain):
            beside = _beside_effects(model_set, selection, location)
            if _is_unknown_input(model_set, beside.location):
                return beside
    return None


def _is_unknown_input(model_set: ModelSet, location: Location) -> bool:
    """Tell whether what is unknown at a place acts in windows, along with nothing known."""
    values = [one.values for one in location.disturbances]
    follows = any(abs(r) > MAX_CORRELATION for _, r in location.correlates)
    if follows or not is_intermittent(values):
        return False
    return (
        input_dependence(model_set.series, values) < MAX_INPUT_DEPENDENCE
        and standstill_dependence(model_set.series, values) < MAX_STANDSTILL_DEPENDENCE
    )


def _may_gain(model_set: ModelSet, model: Estimate, name: str, min_gain: float) -> bool:
    """Tell whether a drift may gain enough beside a model, whose parameters stay where they are."""
    units = disturbance_units(model.candidate, model_set.series, model.values(0))
    small = with_disturbance_levels(model.noise_levels, units, dict.fromkeys(units, SMALL_LEVEL))
    without = evaluate(model.candidate, model_set.series, small, model.point)
    free = scan_level(without, model_set.series, units, name, ALL_LEVELS)
    return (without.cost - free.cost) / integrated_autocorrelation(
        model, model_set.series
    ) > min_gain


def _without_effects(
    model_set: ModelSet, selection: Selection, location: Location
) -> _UnknownInput | None:
    """Return a hidden input that explains much more than what was accepted."""
    assert location.free_model is not None, "a locus with a gain was let free"
    without_input, model = (
        free_disturbance(model_set, selection.base),
        with_normal_equations(location.free_model, model_set.series),
    )
    gained = without_input.cost - model.cost
    if selection.accepted:
        without = _fit_small_disturbances(model_set, selection.model)
        if without_input.cost - without.cost > MAX_EXPLAINED_FRACTION * gained:
            return None
    return _UnknownInput(
        location, model, (), gained, likelihood_gain(model, without_input, model_set.series)
    )


def _add_effects(
    model_set: ModelSet, selection: Selection, unknown_input: _UnknownInput
) -> _UnknownInput:
    """Return a hidden input with the effects that are asked for beside it, of those that gained
    most without it; with none where none was accepted then.
    """
    if not selection.accepted:
        return unknown_input
    model = unknown_input.model
    units = disturbance_units(model.candidate, model_set.series, model.values(0))
    others = {
        name: unit
        for name, unit in units.items()
        if name != unknown_input.location.disturbance_state
    }
    needed = Thresholds(
        default=max(
            DEFAULT_THRESHOLD, MIN_GAIN_RATIO * _supported_gain(unknown_input.likelihood_gain)
        )
    )
    found = select_effects(model_set, model, others, needed, earlier=selection.first_round)
    return dataclasses.replace(unknown_input, model=found.model, effects=found.accepted)


def _beside_effects(model_set: ModelSet, selection: Selection, location: Location) -> _UnknownInput:
    """Return a hidden input beside what was accepted, but for what it makes needless."""
    drift = next(one for one in model_set.disturbances if one.place == location.place)
    without = _fit_small_disturbances(model_set, selection.model)
    model = with_normal_equations(
        free_disturbance(model_set, selection.model, drift), model_set.series
    )
    gained = likelihood_gain(model, without, model_set.series)
    effects = selection.accepted
    for tried in selection.accepted:
        rest = tuple(one for one in effects if one is not tried)
        candidate = model_set.try_compile([one.placed_effect for one in rest])
        if candidate is None:
            continue
        start = extend_vector(candidate, model.candidate, model.point, {})
        fewer = free_disturbance(
            model_set, evaluate(candidate, model_set.series, without.noise_levels, start), drift
        )
        fewer = with_normal_equations(fewer, model_set.series)
        if likelihood_gain(model, fewer, model_set.series).smaller <= DEFAULT_THRESHOLD:
            effects, model = rest, fewer
    if not location.disturbances or not _is_unknown_input(model_set, location):
        location = with_smoothed_disturbances(
            model_set, dataclasses.replace(location, free_model=model, disturbances=())
        )
    explained = free_disturbance(model_set, selection.base).cost - without.cost
    return _UnknownInput(location, model, effects, without.cost - model.cost, gained, explained)


def _fit_small_disturbances(model_set: ModelSet, model: Estimate) -> Estimate:
    """Return a model fitted with next to no drift: what it explains without."""
    units = disturbance_units(model.candidate, model_set.series, model.values(0))
    noise_levels = with_disturbance_levels(
        model.noise_levels, units, dict.fromkeys(units, SMALL_LEVEL)
    )
    return iterate_broyden(
        model.candidate, model_set.series, noise_levels, model.point, MAX_ITERATIONS
    )


def _refit_on_inactive_intervals(
    model_set: ModelSet, location: Location, free_model: Estimate
) -> Location:
    """Return a location with a model whose parameters are fitted where the input does not act.

    The intervals are first those outside the largest values, then those without a significant
    value, if that costs less. The standard deviation is at least the size in inactive intervals.
    """
    least = _energy_level([one.values for one in location.disturbances])
    is_inactive = [np.abs(one.values) < least for one in location.disturbances]
    free_model = refit_on_inactive_intervals(
        free_model, model_set.series, [~one for one in is_inactive], location.disturbance_state
    )
    location = with_smoothed_disturbances(
        model_set, dataclasses.replace(location, free_model=free_model, disturbances=())
    )
    again = refit_on_inactive_intervals(
        free_model,
        model_set.series,
        [one.is_significant for one in location.disturbances],
        location.disturbance_state,
    )
    if again.cost < free_model.cost:
        location = with_smoothed_disturbances(
            model_set, dataclasses.replace(location, free_model=again, disturbances=())
        )
    pairs = zip(location.disturbances, is_inactive, strict=True)
    ratios = np.concatenate([np.abs(one.values / one.stds)[rows] for one, rows in pairs])
    scale = max(1.0, MAD_TO_STD * float(np.median(ratios)))
    wider = (DisturbanceEstimate(one.values, scale * one.stds) for one in location.disturbances)
    return with_disturbances(model_set, location, tuple(wider))


def is_intermittent(disturbances: Sequence[Reals]) -> bool:
    """Return whether a disturbance is small most of the time."""
    whole = np.abs(np.concatenate(disturbances))
    return bool(np.mean(whole >= _energy_level(disturbances)) < MAX_ACTIVE_FRACTION)


def _energy_level(disturbances: Sequence[Reals]) -> float:
    """Return the amount from which on the samples of a drift have most of its squares."""
    falling = np.sort(np.abs(np.concatenate(disturbances)))[::-1]
    whole = np.cumsum(falling**2)
    return float(falling[np.searchsorted(whole, ENERGY_FRACTION * whole[-1])])


def _unknown_input_effects(model_set: ModelSet) -> dict[str, PlacedEffect]:
    """Return, by path, the inputs without parameters that the library knows for balances."""
    balances = {drift.place for drift in model_set.disturbances}
    return {
        f"flow.{placed_effect.place}": placed_effect
        for effect in model_set.effects
        if effect.body.get("parameters") is None
        for placed_effect in find_placements(model_set.document, effect)
        if placed_effect.place in balances
    }
