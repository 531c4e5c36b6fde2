"""Judging: whether a run did what was expected, and where it did not."""

from __future__ import annotations

import bisect
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from engine.trajectory import Trajectory
from expectation.expected import Condition, Expectation, Test, Trigger, When
from expectation.observed import Observed, at_or_before, observed, series, slack
from language.event_name import EventName

Spans = list[tuple[float, float]]
Truths = list[tuple[int, float, bool]]
"""Point, time [s] and whether a condition holds there."""


@dataclass(frozen=True)
class Outcome:
    """What became of an expectation: where it was decided [s], modes and values there."""

    name: str
    passed: bool
    message: str
    time: float | None = None
    modes: Mapping[str, str] = field(default_factory=dict)
    values: Mapping[str, Any] = field(default_factory=dict)


def judged(test: Test, trajectory: Trajectory) -> tuple[Outcome, ...]:
    """Return what became of each expectation in a run."""
    seen = observed(test.system, trajectory)
    return tuple(_Judge(each, seen).outcome() for each in test.expectations)


class _Judge:
    """One expectation of one run."""

    def __init__(self, expectation: Expectation, seen: Observed) -> None:
        self.expectation = expectation
        self.seen = seen

    def outcome(self) -> Outcome:
        expectation = self.expectation
        match expectation.kind:
            case "that":
                return self._that(self._truths(expectation.subject), expectation.when)
            case "always" | "never":
                return self._throughout(self._truths(expectation.subject), expectation.when)
            case "event":
                return self._event(expectation.when)
            case "modes":
                return self._modes(expectation.when)

    # What there is to see.

    def _truths(self, subject: Any) -> Truths:
        found = series(subject, self.seen)
        points = self.seen.points
        return [
            (k, points[k].time, bool(v)) for k, v in zip(found.points, found.values, strict=True)
        ]

    def _occurrences(self, trigger: Trigger, when: When) -> list[float]:
        """Return when something happened, or turned true, in the window [s]."""
        if isinstance(trigger, EventName):
            times = self.seen.times_of(trigger)
        else:
            times = _turns(self._truths(trigger))
        low, high = self._window(when)
        return [time for time in times if low - slack(low) <= time <= high + slack(high)]

    def _window(self, when: When) -> tuple[float, float]:
        low = 0.0 if when.since is None else float(when.since)
        high = self.seen.end if when.until is None else float(when.until)
        return low, high

    def _spans(self, when: When) -> Spans:
        """Return from when to when something is expected [s]: once, or after each event."""
        if when.after is None:
            return [self._window(when)]
        late = float(when.within or 0)
        return [(time, time + late) for time in self._occurrences(when.after, when)]

    # Conditions.

    def _that(self, truths: Truths, when: When) -> Outcome:
        if when.at is not None and when.within is None:
            return self._at(truths, float(when.at))
        if when.at is not None:
            return self._near(
                _turns(truths), float(when.at), float(when.within or 0), "turned true"
            )
        if when.before is not None:
            low, high = float(when.since or 0), float(when.before)
            return self._met(truths, [(low, high)], f"was not true by {_s(high)}")
        late = f"within {_s(float(when.within or 0))} after `{when.after_text}`"
        if not (spans := self._spans(when)):
            return self._never_happened(when)
        return self._met(truths, spans, f"was not true {late}")

    def _at(self, truths: Truths, time: float) -> Outcome:
        held = _held(truths, time)
        if held is None:
            return self._ended(time)
        k, _, value = held
        if self.seen.end < time - slack(time):
            return self._ended(time)
        if value:
            return self._passed(time)
        return self._failed(f"is false at {_s(time)}", time, k)

    def _near(self, times: Sequence[float], at: float, within: float, verb: str) -> Outcome:
        limit = within + slack(at + within)
        nearest = min(times, key=lambda time: abs(time - at), default=None)
        if nearest is not None and abs(nearest - at) <= limit:
            return self._passed(nearest)
        told = f"never {verb}" if nearest is None else f"{verb} at {_s(nearest)}"
        text = f"{told}, expected at {_s(at)}" + (f" within {_s(within)}" if within else "")
        return self._failed(text, at if nearest is None else nearest)

    def _met(self, truths: Truths, spans: Spans, text: str) -> Outcome:
        """Somewhere in each span it is true."""
        first = None
        for low, high in spans:
            met = next((time for _, time, value in self._inside(truths, low, high) if value), None)
            if met is None:
                early = f": the run ended at {_s(self.seen.end)}" if self.seen.end < high else ""
                start = f" at {_s(low)}" if self.expectation.when.after is not None else ""
                return self._failed(f"{text}{start}{early}", high, at_or_before(self.seen, high))
            first = met if first is None else first
        return self._passed(first)

    def _inside(self, truths: Truths, low: float, high: float) -> Truths:
        """Return what modes hold at the start of a span, signals at rows, then all points in it."""
        subject = self.expectation.subject
        if isinstance(subject, Condition) and subject.all_signals:
            start = bisect.bisect_left(truths, low - slack(low), key=lambda each: each[1])
        else:
            start = bisect.bisect_right(truths, low + slack(low), key=lambda each: each[1])
            start = max(start - 1, 0)
        end = bisect.bisect_right(truths, high + slack(high), key=lambda each: each[1])
        return truths[start:end]

    def _throughout(self, truths: Truths, when: When) -> Outcome:
        """In all of each span it is what it is expected to be."""
        wanted = self.expectation.kind == "always"
        spans = self._spans(when)
        if not spans:
            return self._never_happened(when)
        for low, high in spans:
            if self.seen.end < high - slack(high):
                return self._ended(high)
            inside = self._inside(truths, low, high)
            if not inside:
                return self._failed(f"no row lies from {_s(low)} to {_s(high)}: a smaller `every`")
            for k, time, value in inside:
                if value != wanted:
                    at = max(time, low)
                    return self._failed(f"is {str(value).lower()} at {_s(at)}", at, k)
        return self._passed(None)

    # Events and modes.

    def _event(self, when: When) -> Outcome:
        subject = self.expectation.subject
        assert isinstance(subject, EventName)
        times = self.seen.times_of(subject)
        if when.at is not None:
            return self._near(times, float(when.at), float(when.within or 0), "happened")
        if when.before is not None:
            low, high = float(when.since or 0), float(when.before)
            return self._among(times, [(low, high)], f"did not happen by {_s(high)}")
        if when.after is not None:
            late = f"within {_s(float(when.within or 0))} after `{when.after_text}`"
            if not (spans := self._spans(when)):
                return self._never_happened(when)
            return self._among(times, spans, f"did not happen {late}")
        low, high = self._window(when)
        count = sum(low - slack(low) <= time <= high + slack(high) for time in times)
        wanted = self.expectation.count
        if count == wanted or (wanted is None and count):
            return self._passed(times[0] if times else None)
        told = "not once" if count == 0 else f"{count} times" if count > 1 else "once"
        return self._failed(f"happened {told}" + ("" if wanted is None else f", not {wanted}"))

    def _among(self, times: Sequence[float], spans: Spans, text: str) -> Outcome:
        first = None
        for low, high in spans:
            met = next((t for t in times if low - slack(low) <= t <= high + slack(high)), None)
            if met is None:
                start = f" at {_s(low)}" if self.expectation.when.after is not None else ""
                return self._failed(text + start, high, at_or_before(self.seen, high))
            first = met if first is None else first
        return self._passed(first)

    def _modes(self, when: When) -> Outcome:
        """The modes of a region from the window's start on, each as often as it was entered."""
        place, wanted = self.expectation.place, self.expectation.subject
        assert place is not None and isinstance(wanted, tuple)
        low, high = self._window(when)
        start = at_or_before(self.seen, low)
        found = [(max(low, 0.0), self.seen.modes[place][start])]
        for k, mode in self.seen.entered(place, start):
            if self.seen.points[k].time <= high + slack(high):
                found.append((self.seen.points[k].time, mode))
        for (time, mode), expected in zip(found, wanted, strict=False):
            if mode != expected:
                text = f"was `{mode}` from {_s(time)} on, not `{expected}`"
                return self._failed(text, time, at_or_before(self.seen, time))
        if len(found) < len(wanted):
            return self._failed(f"did not enter `{wanted[len(found)]}` after `{found[-1][1]}`")
        if len(found) > len(wanted):
            time, mode = found[len(wanted)]
            return self._failed(
                f"entered `{mode}` at {_s(time)}, after all that was expected", time
            )
        return self._passed(found[-1][0])

    # Outcomes.

    def _passed(self, time: float | None) -> Outcome:
        return Outcome(self.expectation.name, True, "", time)

    def _failed(self, text: str, time: float | None = None, point: int | None = None) -> Outcome:
        if point is None and time is not None:
            point = at_or_before(self.seen, time)
        modes = {} if point is None else self.seen.modes_at(point)
        values = {} if point is None else self._values(point)
        return Outcome(self.expectation.name, False, text, time, modes, values)

    def _ended(self, time: float) -> Outcome:
        return self._failed(
            f"the run ended at {_s(self.seen.end)}, before {_s(time)}", self.seen.end
        )

    def _never_happened(self, when: When) -> Outcome:
        return self._failed(f"`{when.after_text}` never happened")

    def _values(self, point: int) -> dict[str, Any]:
        """Return the signals that the conditions read, at a point or in the row before."""
        rows = [p.row for p in self.seen.points[: point + 1] if p.row >= 0]
        if not rows:
            return {}
        read = [name for each in self.expectation.conditions for name in each.all_signals]
        return {name: self.seen.signals[name][rows[-1]] for name in dict.fromkeys(read)}


def _turns(truths: Truths) -> list[float]:
    """Return when a condition turned true [s]; the start counts."""
    found, before = [], False
    for _, time, value in truths:
        if value and not before:
            found.append(time)
        before = value
    return found


def _held(truths: Truths, time: float) -> tuple[int, float, bool] | None:
    """Return the last point that is not after a time."""
    place = bisect.bisect_right(truths, time + slack(time), key=lambda each: each[1])
    return truths[place - 1] if place else None


def _s(time: float) -> str:
    return f"{time:.9g} s" if math.isfinite(time) else "the end"
