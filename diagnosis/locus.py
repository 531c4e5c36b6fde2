"""Locus: one place where something may be missing, and what is known of it there."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.bench import Bench
from diagnosis.companion import along
from diagnosis.estimate import Estimate
from diagnosis.joined import burnt
from diagnosis.layers import DRIFT, Layer
from diagnosis.scale import scale_of
from diagnosis.series import Series
from diagnosis.smoothing import smoothed

Reals = NDArray[np.float64]
SURE = 3.0
"""An unknown beyond this many of its standard deviations makes a window."""
SWING = 0.2
"""Period of a shuffle [s]: windows nearer than this are one, those of less than half of it none."""
MOST_WINDOWS = 12


@dataclass(frozen=True)
class Unknown:
    """An unknown torque, force or error of a recording behind its burn-in, with its standard
    deviation [SI], (samples,) each.
    """

    values: Reals
    stds: Reals

    @property
    def sure(self) -> NDArray[np.bool_]:
        """The samples (samples,) at which it is not nothing."""
        return np.abs(self.values) > SURE * self.stds


@dataclass(frozen=True)
class Locus:
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
    along: tuple[tuple[str, float], ...] = ()
    part: float = 0.0
    named: bool = False
    free: Estimate | None = dataclasses.field(default=None, repr=False, compare=False)
    drift: str = ""
    unknown: tuple[Unknown, ...] = dataclasses.field(default=(), repr=False, compare=False)

    @property
    def path(self) -> str:
        """`section.name`, as verdicts name places."""
        return f"{self.section}.{self.place}"


def locus_of(bench: Bench, section: str, layer: Layer, free: Estimate) -> Locus:
    """Return what the drift of a layer does at a place where it is free; the gains are not set."""
    drifts = drifts_of(bench.series, free, layer.named(DRIFT))
    size = _rms(drifts)
    return Locus(
        section,
        layer.place,
        0.0,
        size,
        modes=_shares(bench, drifts, free),
        along=along(bench, free, drifts),
        part=_part(bench, section, layer.place, free, size),
        free=free,
        drift=layer.named(DRIFT),
    )


def over_time(bench: Bench, locus: Locus) -> Locus:
    """Return a place with what is unknown there over time, from all that was recorded."""
    if locus.free is None or locus.unknown:
        return locus
    column = locus.free.candidate.predictor.states.index(locus.drift)
    unknown = tuple(
        Unknown(run.states[burnt(one) :, column], run.stds[burnt(one) :, column])
        for one, run in zip(bench.series, smoothed(locus.free, bench.series), strict=True)
    )
    return told(bench, locus, unknown)


def told(bench: Bench, locus: Locus, unknown: tuple[Unknown, ...]) -> Locus:
    """Return a place with what follows from its unknown over time."""
    assert locus.free is not None
    values = [one.values for one in unknown]
    pairs = zip(bench.series, unknown, strict=True)
    windows = [window for one, known in pairs for window in _windows(known, one)]
    windows.sort(key=lambda window: window[0] - window[1])
    size = _rms(values)
    return dataclasses.replace(
        locus,
        rms=size,
        windows=tuple(windows[:MOST_WINDOWS]),
        modes=_shares(bench, values, locus.free),
        along=along(bench, locus.free, values),
        part=_part(bench, locus.section, locus.place, locus.free, size),
        unknown=unknown,
    )


def _part(bench: Bench, section: str, place: str, free: Estimate, size: float) -> float:
    scale = scale_of(bench, section, place, free)
    return size / scale if scale > 0.0 else 0.0


def _rms(values: Sequence[Reals]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(values) ** 2)))


def drifts_of(series: Sequence[Series], free: Estimate, name: str) -> list[Reals]:
    """Return the drift of a name [SI] in each recording (samples,) once its states are found."""
    place = free.candidate.predictor.states.index(name)
    runs = zip(series, free.outcome.predictions, strict=True)
    return [run.states[burnt(one) : run.done, place] for one, run in runs]


def _windows(unknown: Unknown, series: Series) -> list[tuple[float, float, str]]:
    """Return the times [s] of a recording at which something is missing."""
    period = float(series.period)
    start = float(series.start) + burnt(series) * period
    there = np.flatnonzero(unknown.sure)
    if not len(there):
        return []
    parts = np.split(there, np.flatnonzero(np.diff(there) * period > SWING) + 1)
    ends = [(float(part[0]), float(part[-1])) for part in parts]
    return [
        (start + low * period, start + high * period, series.name)
        for low, high in ends
        if (high - low) * period >= 0.5 * SWING
    ]


def _shares(bench: Bench, drifts: Sequence[Reals], free: Estimate) -> dict[str, float]:
    """Return how much of the drift's squares falls into each mode."""
    names = {mode.number: mode.name for mode in bench.automaton.modes.values()}
    runs = zip(bench.series, free.outcome.predictions, strict=True)
    where = np.concatenate([run.modes[burnt(one) : run.done] for one, run in runs])
    squares = np.concatenate(drifts) ** 2
    whole = float(np.sum(squares)) or 1.0
    return {name: float(np.sum(squares[where == number])) / whole for number, name in names.items()}
