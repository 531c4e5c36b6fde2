"""Observation: what measures look at - the events of a run by mode, and its recorded signals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine.batch.batch import NO_EVENT, BatchResult, EventKind
from language.loading.event_names import ModeEntryEvent

Reals = NDArray[np.float64]


@dataclass(frozen=True)
class ModeChange:
    """A transition at a time [s] between two modes."""

    time: float
    source: str
    target: str


@dataclass(frozen=True)
class Observation:
    """One run: transitions by (instance, region) in the order of time, signals (rows,) over times.

    `times` [s] and signals end where the run stopped; `horizon` [s] is where it should have.
    """

    mode_changes: Mapping[tuple[str, str], Sequence[ModeChange]]
    times: Reals
    signals: Mapping[str, Reals]
    horizon: float

    def times_of(self, event: ModeEntryEvent) -> list[float]:
        """Return when an event happened [s]."""
        return [
            happening.time
            for happening in self.mode_changes.get((event.instance, event.region), ())
            if happening.target == event.target and event.source in ("", happening.source)
        ]

    def dwell_intervals(self, event: ModeEntryEvent) -> list[tuple[float, float]]:
        """Return from when to when [s] the mode of an event was active, for each event."""
        intervals = []
        changes = self.mode_changes.get((event.instance, event.region), ())
        for place, happening in enumerate(changes):
            if happening.target == event.target and event.source in ("", happening.source):
                later = (
                    other.time for other in changes[place + 1 :] if other.source == event.target
                )
                intervals.append((happening.time, next(later, self.horizon)))
        return intervals


def observe_variant(result: BatchResult, variant: int, horizon: float) -> Observation:
    """Return one variant of a batch."""
    mode_changes: dict[tuple[str, str], list[ModeChange]] = {}
    for place, time in zip(result.event_kinds[variant], result.event_times[variant], strict=True):
        if place == NO_EVENT:
            break
        kind: EventKind = result.kinds[place]
        if kind.kind == "transition":
            where = mode_changes.setdefault((kind.instance, kind.region), [])
            where.append(ModeChange(float(time), kind.source, kind.target))
    signals = {name: values[variant] for name, values in result.outputs.items()}
    return Observation(mode_changes, result.times, signals, horizon)
