"""Location: a place where physics may be missing, with the disturbance that is estimated there."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.data.stacked_recordings import burn_in_samples
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.place_magnitude import acting_rms, rms
from diagnosis.localisation.correlate import find_correlates
from diagnosis.localisation.smoother import smooth_states
from diagnosis.model.placed_effect import DISTURBANCE_STATE, PlacedEffect

SIGNIFICANT_STDS = 3.0
"""Standard deviations beyond which a disturbance is significant."""
WINDOW_DISTANCE = 1.0
"""Middle times of a recording: nearer windows are merged, windows of less than half are dropped."""
MAX_WINDOWS = 12


@dataclass(frozen=True)
class DisturbanceEstimate:
    """A disturbance after the burn-in of a recording with its deviations [SI], (samples,)."""

    values: Reals
    stds: Reals

    @property
    def is_significant(self) -> NDArray[np.bool_]:
        """The mask (samples,) of values beyond `SIGNIFICANT_STDS` (3) standard deviations."""
        return np.abs(self.values) > SIGNIFICANT_STDS * self.stds


@dataclass(frozen=True)
class Location:
    """A place with a free disturbance of size `rms` [SI]; `gain` [nats] is that of freeing it.

    `fraction` is the size relative to what acts there, `modes` the share of its squares in each
    mode. `free_model` is the fit with `disturbance_state`. For reported places the smoothed
    `disturbances` are known, with their significant `windows` (start, end, recording).
    """

    section: str
    place: str
    gain: float
    rms: float
    windows: tuple[tuple[float, float, str], ...] = ()
    modes: dict[str, float] = field(default_factory=dict)
    correlates: tuple[tuple[str, float], ...] = ()
    fraction: float = 0.0
    is_accepted: bool = False
    free_model: Estimate | None = field(default=None, repr=False, compare=False)
    disturbance_state: str = ""
    disturbances: tuple[DisturbanceEstimate, ...] = field(default=(), repr=False, compare=False)

    @property
    def path(self) -> str:
        """The path `section.name`, as in a verdict."""
        return f"{self.section}.{self.place}"


def location_of(
    model_set: ModelSet, section: str, placed_effect: PlacedEffect, free_model: Estimate
) -> Location:
    """Return the location of a fit from filtered values, with gain 0 and without windows."""
    state = placed_effect.qualified_name(DISTURBANCE_STATE)
    column = free_model.candidate.predictor.states.index(state)
    runs = zip(model_set.series, free_model.prediction.predictions, strict=True)
    drifts = [run.states[burn_in_samples(one) : run.completed, column] for one, run in runs]
    location = Location(
        section, placed_effect.place, 0.0, 0.0, free_model=free_model, disturbance_state=state
    )
    return _with_values(model_set, location, drifts)


def with_smoothed_disturbances(model_set: ModelSet, location: Location) -> Location:
    """Return a location with its smoothed disturbance, if it is free and not smoothed yet.

    Raises ValueError if the model is unstable in every mode.
    """
    if location.free_model is None or location.disturbances:
        return location
    column = location.free_model.candidate.predictor.states.index(location.disturbance_state)
    unknown = []
    smoothed = smooth_states(location.free_model, model_set.series)
    for one, run in zip(model_set.series, smoothed, strict=True):
        known = slice(burn_in_samples(one), None), column
        unknown.append(DisturbanceEstimate(run.states[known], run.stds[known]))
    return with_disturbances(model_set, location, tuple(unknown))


def with_disturbances(
    model_set: ModelSet, location: Location, disturbances: tuple[DisturbanceEstimate, ...]
) -> Location:
    """Return a location with a disturbance over time, and rms, windows and others that follow.

    Significant samples nearer than `WINDOW_DISTANCE` are one window; those shorter than half of it
    are dropped.
    """
    values = [one.values for one in disturbances]
    pairs = zip(model_set.series, disturbances, strict=True)
    windows = [window for one, known in pairs for window in _significant_windows(known, one)]
    windows.sort(key=lambda window: window[0] - window[1])
    location = dataclasses.replace(
        location, windows=tuple(windows[:MAX_WINDOWS]), disturbances=disturbances
    )
    return _with_values(model_set, location, values)


def _with_values(model_set: ModelSet, location: Location, values: Sequence[Reals]) -> Location:
    """Return a location with size, modes and correlates of a disturbance [SI], (samples,) each."""
    free_model = location.free_model
    assert free_model is not None
    size = rms(np.concatenate(values))
    scale = acting_rms(model_set, location.section, location.place, free_model)
    return dataclasses.replace(
        location,
        rms=size,
        modes=_mode_shares(model_set, values, free_model),
        correlates=find_correlates(model_set, free_model, values),
        fraction=size / scale if scale > 0.0 else 0.0,
    )


def _significant_windows(
    disturbance: DisturbanceEstimate, series: SampledRecording
) -> list[tuple[float, float, str]]:
    """Return the windows (start [s], end [s], recording) in which a disturbance is significant."""
    period = float(series.period)
    start = float(series.start) + burn_in_samples(series) * period
    distance = series.sample_count(WINDOW_DISTANCE)
    there = np.flatnonzero(disturbance.is_significant)
    if not len(there):
        return []
    parts = np.split(there, np.flatnonzero(np.diff(there) > distance) + 1)
    ends = [(float(part[0]), float(part[-1])) for part in parts]
    return [
        (start + low * period, start + high * period, series.name)
        for low, high in ends
        if 2.0 * (high - low) >= distance
    ]


def _mode_shares(
    model_set: ModelSet, disturbances: Sequence[Reals], free_model: Estimate
) -> dict[str, float]:
    """Return the share of the disturbance's squares in each mode."""
    names = {mode.number: mode.name for mode in model_set.automaton.modes.values()}
    runs = zip(model_set.series, free_model.prediction.predictions, strict=True)
    where = np.concatenate([run.modes[burn_in_samples(one) : run.completed] for one, run in runs])
    squares = np.concatenate(disturbances) ** 2
    whole = float(np.sum(squares)) or 1.0
    return {name: float(np.sum(squares[where == number])) / whole for number, name in names.items()}
