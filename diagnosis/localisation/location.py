"""Locus: one place where something may be missing, and what is known of it there."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.data.stacked_recordings import burn_in_samples
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.localisation.acting_scale import acting_rms
from diagnosis.localisation.correlate import find_correlates
from diagnosis.localisation.smoother import smooth_states
from diagnosis.model.placed_effect import DISTURBANCE_STATE, PlacedEffect

Reals = NDArray[np.float64]
SIGNIFICANT_STDS = 3.0
"""An unknown beyond this many of its standard deviations makes a window."""
OSCILLATION_PERIOD = 0.2
"""Period of a shuffle [s]: windows nearer than this are one, those of less than half of it none."""
MAX_WINDOWS = 12


@dataclass(frozen=True)
class DisturbanceEstimate:
    """An unknown torque, force or error of a recording behind its burn-in, with its standard
    deviation [SI], (samples,) each.
    """

    values: Reals
    stds: Reals

    @property
    def is_significant(self) -> NDArray[np.bool_]:
        """The samples (samples,) at which it is not nothing."""
        return np.abs(self.values) > SIGNIFICANT_STDS * self.stds


@dataclass(frozen=True)
class Location:
    """One place: `gain` [nats] of its freedom over none; `rms` of its drift [SI], and that as a
    `part` of what acts there; its share by mode, and what it goes `along` with. At a `named` one
    stands an effect that was accepted. `free` is a model with this freedom - its state `drift` -
    and its parameters fitted beside it. Of the places that are told it is known over time
    (`unknown`, for each recording), and in which `windows` (start, end, recording) it is there.
    """

    section: str
    place: str
    gain: float
    rms: float
    windows: tuple[tuple[float, float, str], ...] = ()
    modes: dict[str, float] = dataclasses.field(default_factory=dict)
    correlates: tuple[tuple[str, float], ...] = ()
    fraction: float = 0.0
    is_accepted: bool = False
    free_model: Estimate | None = dataclasses.field(default=None, repr=False, compare=False)
    disturbance_state: str = ""
    disturbances: tuple[DisturbanceEstimate, ...] = dataclasses.field(
        default=(), repr=False, compare=False
    )

    @property
    def path(self) -> str:
        """`section.name`, as verdicts name places."""
        return f"{self.section}.{self.place}"


def location_of(
    model_set: ModelSet, section: str, placed_effect: PlacedEffect, free_model: Estimate
) -> Location:
    """Return what the drift of a layer does at a place where it is free; the gains are not set."""
    drifts = disturbances_of(
        model_set.series, free_model, placed_effect.qualified_name(DISTURBANCE_STATE)
    )
    size = _rms(drifts)
    return Location(
        section,
        placed_effect.place,
        0.0,
        size,
        modes=_mode_shares(model_set, drifts, free_model),
        correlates=find_correlates(model_set, free_model, drifts),
        fraction=_relative_size(model_set, section, placed_effect.place, free_model, size),
        free_model=free_model,
        disturbance_state=placed_effect.qualified_name(DISTURBANCE_STATE),
    )


def with_smoothed_disturbances(model_set: ModelSet, location: Location) -> Location:
    """Return a place with what is unknown there over time, from all that was recorded."""
    if location.free_model is None or location.disturbances:
        return location
    column = location.free_model.candidate.predictor.states.index(location.disturbance_state)
    unknown = tuple(
        DisturbanceEstimate(
            run.states[burn_in_samples(one) :, column], run.stds[burn_in_samples(one) :, column]
        )
        for one, run in zip(
            model_set.series, smooth_states(location.free_model, model_set.series), strict=True
        )
    )
    return with_disturbances(model_set, location, unknown)


def with_disturbances(
    model_set: ModelSet, location: Location, disturbances: tuple[DisturbanceEstimate, ...]
) -> Location:
    """Return a place with what follows from its unknown over time."""
    assert location.free_model is not None
    values = [one.values for one in disturbances]
    pairs = zip(model_set.series, disturbances, strict=True)
    windows = [window for one, known in pairs for window in _significant_windows(known, one)]
    windows.sort(key=lambda window: window[0] - window[1])
    size = _rms(values)
    return dataclasses.replace(
        location,
        rms=size,
        windows=tuple(windows[:MAX_WINDOWS]),
        modes=_mode_shares(model_set, values, location.free_model),
        correlates=find_correlates(model_set, location.free_model, values),
        fraction=_relative_size(
            model_set, location.section, location.place, location.free_model, size
        ),
        disturbances=disturbances,
    )


def _relative_size(
    model_set: ModelSet, section: str, place: str, free_model: Estimate, size: float
) -> float:
    scale = acting_rms(model_set, section, place, free_model)
    return size / scale if scale > 0.0 else 0.0


def _rms(values: Sequence[Reals]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(values) ** 2)))


def disturbances_of(
    series: Sequence[SampledRecording], free_model: Estimate, name: str
) -> list[Reals]:
    """Return the drift of a name [SI] in each recording (samples,) once its states are found."""
    place = free_model.candidate.predictor.states.index(name)
    runs = zip(series, free_model.prediction.predictions, strict=True)
    return [run.states[burn_in_samples(one) : run.completed, place] for one, run in runs]


def _significant_windows(
    disturbance: DisturbanceEstimate, series: SampledRecording
) -> list[tuple[float, float, str]]:
    """Return the times [s] of a recording at which something is missing."""
    period = float(series.period)
    start = float(series.start) + burn_in_samples(series) * period
    there = np.flatnonzero(disturbance.is_significant)
    if not len(there):
        return []
    parts = np.split(there, np.flatnonzero(np.diff(there) * period > OSCILLATION_PERIOD) + 1)
    ends = [(float(part[0]), float(part[-1])) for part in parts]
    return [
        (start + low * period, start + high * period, series.name)
        for low, high in ends
        if (high - low) * period >= 0.5 * OSCILLATION_PERIOD
    ]


def _mode_shares(
    model_set: ModelSet, disturbances: Sequence[Reals], free_model: Estimate
) -> dict[str, float]:
    """Return how much of the drift's squares falls into each mode."""
    names = {mode.number: mode.name for mode in model_set.automaton.modes.values()}
    runs = zip(model_set.series, free_model.prediction.predictions, strict=True)
    where = np.concatenate([run.modes[burn_in_samples(one) : run.completed] for one, run in runs])
    squares = np.concatenate(disturbances) ** 2
    whole = float(np.sum(squares)) or 1.0
    return {name: float(np.sum(squares[where == number])) / whole for number, name in names.items()}
