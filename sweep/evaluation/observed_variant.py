"""Observed variant: the mode changes and the recorded signals of one run, the input of measures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from engine.batch.batch import NO_EVENT, BatchResult, EventKind
from engine.results.array_types import Reals
from language.loading.mode_entry_event import ModeEntryEvent


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
        """Return the times [s] at which the event's mode was entered, in ascending order.

        An event without a source counts entries from any mode. The initial mode is no entry.
        """
        return [
            happening.time
            for happening in self.mode_changes.get((event.instance, event.region), ())
            if happening.target == event.target and event.source in ("", happening.source)
        ]

    def dwell_intervals(self, event: ModeEntryEvent) -> list[tuple[float, float]]:
        """Return (start, end) [s] of the event's mode, one for each occurrence of the event.

        The end is the next transition out of the mode, or the horizon if there is none.
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
    """Return the observation of one variant of a batch, by its index in the batch.

    Only transitions among its events count. `horizon` [s] is the planned end of the run.
    """
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
