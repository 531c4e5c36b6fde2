"""Observation: the mode changes and the recorded signals of one run, the input of measures."""

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
    """A transition at a time [s] from one mode to another."""

    time: float
    source: str
    target: str


@dataclass(frozen=True)
class Observation:
    """One run: mode changes by (instance, region) in order of time, and signals (n_rows,) over
    `times`.

    `times` [s] and signals end where the run stopped; `horizon` [s] is its planned end.
    """

    mode_changes: Mapping[tuple[str, str], Sequence[ModeChange]]
    times: Reals
    signals: Mapping[str, Reals]
    horizon: float

    def times_of(self, event: ModeEntryEvent) -> list[float]:
        """Return the times [s] of an event in ascending order."""
        return [
            happening.time
            for happening in self.mode_changes.get((event.instance, event.region), ())
            if happening.target == event.target and event.source in ("", happening.source)
        ]

    def dwell_intervals(self, event: ModeEntryEvent) -> list[tuple[float, float]]:
        """Return start and end [s] of the active interval of the event's mode, one for each event.

        A mode that is active at the end has the horizon as end.
        """
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
    """Return the observation of one variant of a batch, by its place in the batch."""
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
