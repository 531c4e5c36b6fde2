"""Locus: one place where something may be missing, and what is known of it there."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.bench import Bench
from diagnosis.companion import along
from diagnosis.estimation import Estimate
from diagnosis.layers import DRIFT, Layer
from diagnosis.prediction import burnt
from diagnosis.scale import scale_of
from diagnosis.series import Series

Reals = NDArray[np.float64]
LOUD = 2.0
"""A drift beyond this many of its own standard deviations makes a window."""
SHORTEST = 0.05
"""Windows nearer than this [s] are one."""
MOST_WINDOWS = 12


@dataclass(frozen=True)
class Locus:
    """One place: `gain` [nats] of its freedom over none; `rms` of its drift [SI], and that as a
    `part` of what acts there; the `windows` (start, end, recording) in which it is loud, its share
    by mode, and what it goes `along` with. At a `named` one stands an effect that was accepted.
    `free` is the base with this freedom - its state `drift` - and its parameters fitted beside it.
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

    @property
    def path(self) -> str:
        """`section.name`, as verdicts name places."""
        return f"{self.section}.{self.place}"


def locus_of(bench: Bench, section: str, layer: Layer, free: Estimate) -> Locus:
    """Return what the drift of a layer does at a place where it is free; the gains are not set."""
    drifts = drifts_of(bench.series, free, layer.named(DRIFT))
    predictions = zip(bench.series, free.outcome.predictions, strict=True)
    modes = [run.modes[burnt(one) : run.done] for one, run in predictions]
    size = float(np.sqrt(np.mean(np.concatenate(drifts) ** 2)))
    windows = [
        window
        for one, values in zip(bench.series, drifts, strict=True)
        for window in _windows(values, size, one)
    ]
    windows.sort(key=lambda window: window[0] - window[1])
    scale = scale_of(bench, section, layer.place, free)
    return Locus(
        section,
        layer.place,
        0.0,
        size,
        tuple(windows[:MOST_WINDOWS]),
        _shares(bench, drifts, modes),
        along(bench, free, drifts),
        part=size / scale if scale > 0.0 else 0.0,
        free=free,
        drift=layer.named(DRIFT),
    )


def drifts_of(series: Sequence[Series], free: Estimate, name: str) -> list[Reals]:
    """Return the drift of a name [SI] in each recording (samples,) once its states are found."""
    place = free.candidate.predictor.states.index(name)
    runs = zip(series, free.outcome.predictions, strict=True)
    return [run.states[burnt(one) : run.done, place] for one, run in runs]


def _windows(values: Reals, size: float, series: Series) -> list[tuple[float, float, str]]:
    """Return the times [s] of a recording at which a drift is loud."""
    period = float(series.period)
    start = float(series.start) + burnt(series) * period
    loud = np.flatnonzero(np.abs(values) > LOUD * size) if size > 0.0 else np.array([], dtype=int)
    if not len(loud):
        return []
    parts = np.split(loud, np.flatnonzero(np.diff(loud) * period > SHORTEST) + 1)
    return [(start + part[0] * period, start + part[-1] * period, series.name) for part in parts]


def _shares(
    bench: Bench, drifts: Sequence[Reals], modes: Sequence[NDArray[np.int16]]
) -> dict[str, float]:
    """Return how much of the drift's squares falls into each mode."""
    names = {mode.number: mode.name for mode in bench.automaton.modes.values()}
    squares, where = np.concatenate(drifts) ** 2, np.concatenate(modes)
    whole = float(np.sum(squares)) or 1.0
    return {name: float(np.sum(squares[where == number])) / whole for number, name in names.items()}
