"""Evaluation: decide whether a run meets the expectations of a test, and where it fails."""

from __future__ import annotations

import bisect
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from engine.results.trajectory import Trajectory
from expectation.expectations import Condition, Expectation, Test, TimeConstraint, Trigger
from expectation.observed_run import (
    ObservedRun,
    evaluate_series,
    observe_run,
    point_at_or_before,
    time_tolerance,
)
from language.loading.mode_entry_event import ModeEntryEvent

TimeSpans = list[tuple[float, float]]
TruthSeries = list[tuple[int, float, bool]]
"""The value of a condition as (point, time [s], value) in order of time."""


@dataclass(frozen=True)
class Outcome:
    """The result of an expectation with the time [s] of the decision, and modes and values
    there.
    """

    name: str
    passed: bool
    message: str
    time: float | None = None
    modes: Mapping[str, str] = field(default_factory=dict)
    values: Mapping[str, Any] = field(default_factory=dict)


def evaluate_test(test: Test, trajectory: Trajectory) -> tuple[Outcome, ...]:
    """Return the outcomes of all expectations of a test, in their order.

    An expectation with a trigger fails if the trigger never occurs, one with a time if the run
    ended before it. Conditions of signals are evaluated at recorded rows only. `time` and `message`
    of a failure tell where and why; a passed one has an empty message.
    """
    run = observe_run(test.system, trajectory)
    return tuple(_ExpectationEvaluator(each, run).evaluate() for each in test.expectations)


class _ExpectationEvaluator:
    """Evaluation of one expectation on one run."""

    def __init__(self, expectation: Expectation, run: ObservedRun) -> None:
        self.expectation = expectation
        self.run = run

    def evaluate(self) -> Outcome:
        """Return the outcome of the expectation."""
        expectation = self.expectation
        match expectation.kind:
            case "that":
                return self._evaluate_that(
                    self._truth_series(expectation.subject), expectation.when
                )
            case "always" | "never":
                return self._check_throughout(
                    self._truth_series(expectation.subject), expectation.when
                )
            case "event":
                return self._evaluate_event(expectation.when)
            case "modes":
                return self._evaluate_modes(expectation.when)

    # Observations.

    def _truth_series(self, subject: Any) -> TruthSeries:
        """Return the values of a condition at the points where it is known."""
        found = evaluate_series(subject, self.run)
        points = self.run.points
        return [
            (k, points[k].time, bool(v)) for k, v in zip(found.points, found.values, strict=True)
        ]

    def _occurrences(self, trigger: Trigger, when: TimeConstraint) -> list[float]:
        """Return the times [s] in the window at which an event occurred or a condition became
        true.
        """
        if isinstance(trigger, ModeEntryEvent):
            times = self.run.times_of(trigger)
        else:
            times = _rising_times(self._truth_series(trigger))
        low, high = self._window(when)
        return [
            time
            for time in times
            if low - time_tolerance(low) <= time <= high + time_tolerance(high)
        ]

    def _window(self, when: TimeConstraint) -> tuple[float, float]:
        """Return start and end [s] of the constraint `from` and `until`.

        By default this is the whole run.
        """
        low = 0.0 if when.since is None else float(when.since)
        high = self.run.end if when.until is None else float(when.until)
        return low, high

    def _spans(self, when: TimeConstraint) -> TimeSpans:
        """Return the intervals [s] of the expectation: the window, or one after each trigger."""
        if when.after is None:
            return [self._window(when)]
        late = float(when.within or 0)
        return [(time, time + late) for time in self._occurrences(when.after, when)]

    # Conditions.

    def _evaluate_that(self, truths: TruthSeries, when: TimeConstraint) -> Outcome:
        """Return the outcome of `that`.

        The condition must hold at a time, become true near a time, hold once before a time, or hold
        once after each trigger.
        """
        if when.at is not None and when.within is None:
            return self._check_at(truths, float(when.at))
        if when.at is not None:
            return self._check_near(
                _rising_times(truths), float(when.at), float(when.within or 0), "turned true"
            )
        if when.before is not None:
            low, high = float(when.since or 0), float(when.before)
            return self._check_eventually(
                truths, [(low, high)], f"was not true by {_format_time(high)}"
            )
        late = f"within {_format_time(float(when.within or 0))} after `{when.after_text}`"
        if not (spans := self._spans(when)):
            return self._fail_no_trigger(when)
        return self._check_eventually(truths, spans, f"was not true {late}")

    def _check_at(self, truths: TruthSeries, time: float) -> Outcome:
        """Return whether the condition holds at a time; fails if the run ended before."""
        held = _last_not_after(truths, time)
        if held is None:
            return self._fail_run_ended(time)
        k, _, value = held
        if self.run.end < time - time_tolerance(time):
            return self._fail_run_ended(time)
        if value:
            return self._pass(time)
        return self._fail(f"is false at {_format_time(time)}", time, k)

    def _check_near(self, times: Sequence[float], at: float, within: float, verb: str) -> Outcome:
        """Return whether one of the times is within a distance of the expected time."""
        limit = within + time_tolerance(at + within)
        nearest = min(times, key=lambda time: abs(time - at), default=None)
        if nearest is not None and abs(nearest - at) <= limit:
            return self._pass(nearest)
        observed_text = f"never {verb}" if nearest is None else f"{verb} at {_format_time(nearest)}"
        text = f"{observed_text}, expected at {_format_time(at)}" + (
            f" within {_format_time(within)}" if within else ""
        )
        return self._fail(text, at if nearest is None else nearest)

    def _check_eventually(self, truths: TruthSeries, spans: TimeSpans, text: str) -> Outcome:
        """Return whether the condition is true at a point in each interval.

        The outcome fails at the first interval without such a point.
        """
        first = None
        for low, high in spans:
            hit = next(
                (time for _, time, value in self._truths_within(truths, low, high) if value), None
            )
            if hit is None:
                early = (
                    f": the run ended at {_format_time(self.run.end)}"
                    if self.run.end < high
                    else ""
                )
                start = (
                    f" at {_format_time(low)}" if self.expectation.when.after is not None else ""
                )
                return self._fail(f"{text}{start}{early}", high, point_at_or_before(self.run, high))
            first = hit if first is None else first
        return self._pass(first)

    def _truths_within(self, truths: TruthSeries, low: float, high: float) -> TruthSeries:
        """Return the part of a series in a closed interval.

        A condition of modes only also has the value that holds at the start; signals count at rows
        only.
        """
        subject = self.expectation.subject
        if isinstance(subject, Condition) and subject.all_signals:
            start = bisect.bisect_left(truths, low - time_tolerance(low), key=lambda each: each[1])
        else:
            start = bisect.bisect_right(truths, low + time_tolerance(low), key=lambda each: each[1])
            start = max(start - 1, 0)
        end = bisect.bisect_right(truths, high + time_tolerance(high), key=lambda each: each[1])
        return truths[start:end]

    def _check_throughout(self, truths: TruthSeries, when: TimeConstraint) -> Outcome:
        """Return whether the condition is true (`always`) or false (`never`) in each interval.

        Fails if the run ended before the end of an interval or no row lies in it.
        """
        expected_truth = self.expectation.kind == "always"
        spans = self._spans(when)
        if not spans:
            return self._fail_no_trigger(when)
        for low, high in spans:
            if self.run.end < high - time_tolerance(high):
                return self._fail_run_ended(high)
            inside = self._truths_within(truths, low, high)
            if not inside:
                interval = f"from {_format_time(low)} to {_format_time(high)}"
                return self._fail(f"no row lies {interval}: a smaller `every`")
            for k, time, value in inside:
                if value != expected_truth:
                    at = max(time, low)
                    return self._fail(f"is {str(value).lower()} at {_format_time(at)}", at, k)
        return self._pass(None)

    # Events and modes.

    def _evaluate_event(self, when: TimeConstraint) -> Outcome:
        """Return the outcome of `event`.

        The event must occur near a time, before a time, after each trigger, or as often as expected
        in the window.
        """
        subject = self.expectation.subject
        assert isinstance(subject, ModeEntryEvent)
        times = self.run.times_of(subject)
        if when.at is not None:
            return self._check_near(times, float(when.at), float(when.within or 0), "happened")
        if when.before is not None:
            low, high = float(when.since or 0), float(when.before)
            return self._check_event_in_spans(
                times, [(low, high)], f"did not happen by {_format_time(high)}"
            )
        if when.after is not None:
            late = f"within {_format_time(float(when.within or 0))} after `{when.after_text}`"
            if not (spans := self._spans(when)):
                return self._fail_no_trigger(when)
            return self._check_event_in_spans(times, spans, f"did not happen {late}")
        low, high = self._window(when)
        count = sum(
            low - time_tolerance(low) <= time <= high + time_tolerance(high) for time in times
        )
        expected_count = self.expectation.count
        if count == expected_count or (expected_count is None and count):
            return self._pass(times[0] if times else None)
        count_text = "not once" if count == 0 else f"{count} times" if count > 1 else "once"
        return self._fail(
            f"happened {count_text}" + ("" if expected_count is None else f", not {expected_count}")
        )

    def _check_event_in_spans(self, times: Sequence[float], spans: TimeSpans, text: str) -> Outcome:
        """Return whether an event occurred in each interval; fails at the first without one."""
        first = None
        for low, high in spans:
            hit = next(
                (t for t in times if low - time_tolerance(low) <= t <= high + time_tolerance(high)),
                None,
            )
            if hit is None:
                start = (
                    f" at {_format_time(low)}" if self.expectation.when.after is not None else ""
                )
                return self._fail(text + start, high, point_at_or_before(self.run, high))
            first = hit if first is None else first
        return self._pass(first)

    def _evaluate_modes(self, when: TimeConstraint) -> Outcome:
        """Return whether a region had exactly the expected modes in the window, in order.

        A mode counts once for each entry.
        """
        place, expected_modes = self.expectation.region_ref, self.expectation.subject
        assert place is not None and isinstance(expected_modes, tuple)
        low, high = self._window(when)
        start = point_at_or_before(self.run, low)
        entries = [(max(low, 0.0), self.run.modes[place][start])]
        for k, mode in self.run.mode_entries(place, start):
            if self.run.points[k].time <= high + time_tolerance(high):
                entries.append((self.run.points[k].time, mode))
        for (time, mode), expected in zip(entries, expected_modes, strict=False):
            if mode != expected:
                text = f"was `{mode}` from {_format_time(time)} on, not `{expected}`"
                return self._fail(text, time, point_at_or_before(self.run, time))
        if len(entries) < len(expected_modes):
            return self._fail(
                f"did not enter `{expected_modes[len(entries)]}` after `{entries[-1][1]}`"
            )
        if len(entries) > len(expected_modes):
            time, mode = entries[len(expected_modes)]
            return self._fail(
                f"entered `{mode}` at {_format_time(time)}, after all that was expected", time
            )
        return self._pass(entries[-1][0])

    # Outcomes.

    def _pass(self, time: float | None) -> Outcome:
        """Return a passed outcome."""
        return Outcome(self.expectation.name, True, "", time)

    def _fail(self, text: str, time: float | None = None, point: int | None = None) -> Outcome:
        """Return a failed outcome with modes and signals at a point.

        By default this is the last point that is not later than `time`.
        """
        if point is None and time is not None:
            point = point_at_or_before(self.run, time)
        modes = {} if point is None else self.run.modes_at(point)
        values = {} if point is None else self._signal_values(point)
        return Outcome(self.expectation.name, False, text, time, modes, values)

    def _fail_run_ended(self, time: float) -> Outcome:
        """Return a failed outcome because the run ended before a time."""
        return self._fail(
            f"the run ended at {_format_time(self.run.end)}, before {_format_time(time)}",
            self.run.end,
        )

    def _fail_no_trigger(self, when: TimeConstraint) -> Outcome:
        """Return a failed outcome because the trigger did not occur."""
        return self._fail(f"`{when.after_text}` never happened")

    def _signal_values(self, point: int) -> dict[str, Any]:
        """Return the signals of the conditions in the last row at or before a point.

        The result is empty without rows.
        """
        rows = [p.row for p in self.run.points[: point + 1] if p.row >= 0]
        if not rows:
            return {}
        read = [name for each in self.expectation.conditions for name in each.all_signals]
        return {name: self.run.signals[name][rows[-1]] for name in dict.fromkeys(read)}


def _rising_times(truths: TruthSeries) -> list[float]:
    """Return the times [s] at which a condition became true; a true start counts."""
    found, before = [], False
    for _, time, value in truths:
        if value and not before:
            found.append(time)
        before = value
    return found


def _last_not_after(truths: TruthSeries, time: float) -> tuple[int, float, bool] | None:
    """Return the last entry whose time is not later; None if there is none."""
    place = bisect.bisect_right(truths, time + time_tolerance(time), key=lambda each: each[1])
    return truths[place - 1] if place else None


def _format_time(time: float) -> str:
    """Return a time with nine digits and unit; `the end` for infinity."""
    return f"{time:.9g} s" if math.isfinite(time) else "the end"
