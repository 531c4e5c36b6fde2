"""Place scale: the magnitudes of a place of which parameters of effects are multiples.

The library of effects has no size of its own: a dry friction starts at a fraction of the load of
the balance, a delay at a fraction of the correlation time of its signal.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.data.stacked_recordings import burn_in_samples
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.place_magnitude import acting_rms, coefficient_value, rms
from diagnosis.model.placed_effect import PlacedEffect, place_path, round_scale
from language.expressions.units import parse_unit
from language.overlays.effect_place import EffectPlace, find_effect_place

DECORRELATED = 0.5
"""Half the mean square difference of two samples, relative to the variance, at which they count as
independent of each other."""
MIN_TIME = 30.0
"""Least magnitude of a time in periods: shorter delays and lags hardly show."""
LAG_RATIO = 1.2
"""Ratio between successive lags at which the correlation of a signal is examined."""


def with_scales(model_set: ModelSet, base: Estimate) -> ModelSet:
    """Return the model set with the magnitudes of all places, from its recordings and the base."""
    scales: dict[str, Mapping[str, Fraction]] = {}
    for placed_effect in model_set.applicable_effects():
        path = place_path(placed_effect)
        if path not in scales:
            scales[path] = place_scales(model_set, base, placed_effect)
    return dataclasses.replace(model_set, scales=scales)


def place_scales(
    model_set: ModelSet, base: Estimate, placed_effect: PlacedEffect
) -> dict[str, Fraction]:
    """Return the magnitudes [SI] of the place of an effect, by the names of `SCALE_NAMES`.

    Each is rounded to one or three times a power of ten, so that similar recordings have the same
    compiled candidates. Magnitudes that are 0 or not known are left out.
    """
    period = float(model_set.period)
    horizon = period * float(np.median([one.count for one in model_set.series]))
    found = {"period": period, "horizon": horizon}
    place = find_effect_place(model_set.document.root, placed_effect.effect, placed_effect.place)
    if isinstance(place, EffectPlace):
        texts = {key: value for key, value in place.holes.items() if isinstance(value, str)}
        found |= _magnitudes(model_set, base, placed_effect.place, texts)
        signals = _signals(model_set, base, placed_effect.place, texts)
        found["time"] = max(correlation_time(signals, period) or horizon, MIN_TIME * period)
    return {
        name: round_scale(value)
        for name, value in found.items()
        if value > 0.0 and math.isfinite(value)
    }


def correlation_time(signals: Sequence[Reals], period: float) -> float:
    """Return the lag [s] at which two samples of a signal are about independent.

    This is the first lag at which half the mean square difference of two samples reaches half of
    the variance within recordings; 0 if there is none. It needs no derivative, so noise and
    quantisation do not matter.
    """
    centred = [one - one.mean() for one in signals if len(one) > 1]
    if not centred:
        return 0.0
    variance = float(np.mean(np.concatenate(centred) ** 2))
    lag, longest = 1.0, max(len(one) for one in centred)
    while variance > 0.0 and lag < longest:
        steps = round(lag)
        moved = [one[steps:] - one[:-steps] for one in centred if len(one) > steps]
        if 0.5 * float(np.mean(np.concatenate(moved) ** 2)) >= DECORRELATED * variance:
            return steps * period
        lag = max(lag * LAG_RATIO, lag + 1.0)
    return 0.0


def _magnitudes(
    model_set: ModelSet, base: Estimate, place: str, texts: Mapping[str, str]
) -> dict[str, float]:
    """Return inertia, rate, least magnitude, load, stretch and level of a place whose holes have
    given texts.
    """
    found: dict[str, float] = {}
    if "inertia" in texts:
        found["inertia"] = abs(coefficient_value(model_set, base, texts["inertia"]) or 0.0)
    rate = texts.get("x") or texts.get("speed", "")
    turning = rate or texts.get("angle_rate") or texts.get("rate", "")
    found["rate"] = _level(_states(base, model_set, turning))
    found["least"] = _least(_states(base, model_set, texts.get("x", "")))
    if "twist" in texts:
        found["load"] = acting_rms(model_set, "elements", place, base)
        stiffness = coefficient_value(model_set, base, texts.get("stiffness", ""))
        found["stretch"] = found["load"] / abs(stiffness) if stiffness else 0.0
    elif rate:
        found["load"] = _balance_load(model_set, base, rate, texts.get("force", ""))
    found["level"] = _level(_signals(model_set, base, place, texts))
    return found


def _balance_load(model_set: ModelSet, base: Estimate, state: str, force: str) -> float:
    """Return the larger one of what accelerates a state and inputs in the unit of its balance."""
    acting = acting_rms(model_set, "flow", state, base)
    dimension = parse_unit(force).dimension.powers if force else None
    inputs = [
        _level([one.inputs[:, k] for one in model_set.series])
        for k, declared in enumerate(model_set.automaton.inputs.values())
        if declared.unit.dimension.powers == dimension
    ]
    return max([acting, *inputs])


def _signals(
    model_set: ModelSet, base: Estimate, place: str, texts: Mapping[str, str]
) -> list[Reals]:
    """Return the signal of a place per recording: input, measured output, twist or state."""
    if "u" in texts and place in model_set.automaton.inputs:
        column = list(model_set.automaton.inputs).index(place)
        return [one.inputs[:, column] for one in model_set.series]
    if "y" in texts and place in model_set.output_names:
        column = model_set.output_names.index(place)
        measured = [one.measured[:, column] for one in model_set.series]
        return [one[np.isfinite(one)] for one in measured]
    name = texts.get("twist") or texts.get("speed") or texts.get("x", "")
    return _states(base, model_set, name)


def _states(base: Estimate, model_set: ModelSet, name: str) -> list[Reals]:
    """Return the predictions of a state per recording after the burn-in; empty for no state."""
    states = base.candidate.predictor.states
    if name not in states:
        return []
    runs = zip(model_set.series, base.prediction.predictions, strict=True)
    column = states.index(name)
    return [run.states[burn_in_samples(one) : run.completed, column] for one, run in runs]


def _least(signals: Sequence[Reals]) -> float:
    """Return the least magnitude of a signal over recordings; 0 if it changes its sign."""
    low = min((float(np.min(one)) for one in signals if len(one)), default=0.0)
    high = max((float(np.max(one)) for one in signals if len(one)), default=0.0)
    return min(abs(low), abs(high)) if low * high > 0.0 else 0.0


def _level(signals: Sequence[Reals]) -> float:
    """Return the root mean square of a signal over recordings; 0 for none."""
    return rms(np.concatenate(signals)) if signals else 0.0
