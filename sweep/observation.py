"""Observation: what measures look at - the events of a run by mode, and its recorded signals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine.batch import NO_EVENT, BatchResult, EventKind
from language.event_name import EventName

Reals = NDArray[np.float64]


@dataclass(frozen=True)
class Happening:
    """A transition at a time [s] between two modes."""

    time: float
    source: str
    target: str


@dataclass(frozen=True)
class Observation:
    """One run: transitions by (instance, region) in the order of time, signals (rows,) over times.

    `times` [s] and signals end where the run stopped; `horizon` [s] is where it should have.
    """

    happenings: Mapping[tuple[str, str], Sequence[Happening]]
    times: Reals
    signals: Mapping[str, Reals]
    horizon: float

    def times_of(self, event: EventName) -> list[float]:
        """Return when an event happened [s]."""
        return [
            happening.time
            for happening in self.happenings.get((event.instance, event.region), ())
            if happening.target == event.target and event.source in ("", happening.source)
        ]

    def stays(self, event: EventName) -> list[tuple[float, float]]:
        """Return from when to when [s] the mode of an event was active, for each event."""
        found = []
        line = self.happenings.get((event.instance, event.region), ())
        for place, happening in enumerate(line):
            if happening.target == event.target and event.source in ("", happening.source):
                later = (other.time for other in line[place + 1 :] if other.source == event.target)
                found.append((happening.time, next(later, self.horizon)))
        return found


def observed(result: BatchResult, variant: int, horizon: float) -> Observation:
    """Return one variant of a batch."""
    line: dict[tuple[str, str], list[Happening]] = {}
    for place, time in zip(result.event_kinds[variant], result.event_times[variant], strict=True):
        if place == NO_EVENT:
            break
        kind: EventKind = result.kinds[place]
        if kind.kind == "transition":
            where = line.setdefault((kind.instance, kind.region), [])
            where.append(Happening(float(time), kind.source, kind.target))
    signals = {name: values[variant] for name, values in result.outputs.items()}
    return Observation(line, result.times, signals, horizon)
