"""Measure evaluation: compute the columns of all measures from one observed run.

A value of None means that the run has no such number, e.g. because an event did not happen.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from language.ir.ops import Ref
from language.lowering.expressions import lower_assigned_value, lower_expression
from language.numerics.evaluate import evaluate
from sweep.definition.measure import (
    Bound,
    DelayMeasure,
    EventMeasure,
    MatchMeasure,
    Measure,
    SignalMeasure,
    ValueMeasure,
)
from sweep.evaluation.observed_variant import Observation
from sweep.evaluation.waveform import evaluate_signal

Cell = float | int | bool | str | list[float] | None
"""The value of a column for one variant."""
Window = tuple[float, float] | None
"""Start and end [s] of a time window; None if an end is an undefined measure."""


def evaluate_measures(measures: Sequence[Measure], run: Observation) -> dict[str, Cell]:
    """Return the values of all columns of the measures by name, in their order.

    Measures are evaluated in their order, since windows and expressions refer to earlier ones. A
    value is None if the event or signal has no such number, if an end of the window or an operand
    is None, or if an expression is not finite. In a match without a window the counts are 0.
    """
    cells: dict[str, Cell] = {}
    for measure in measures:
        if isinstance(measure, ValueMeasure):
            cells[measure.name] = _measure_value(measure, cells)
            continue
        window = _resolve_window(measure.since, measure.until, cells, run.horizon)
        match measure:
            case EventMeasure():
                cells[measure.name] = _measure_event(measure, run, window)
            case DelayMeasure():
                cells[measure.name] = _measure_delay(measure, run, window)
            case MatchMeasure():
                cells |= _measure_match(measure, run, window)
            case SignalMeasure():
                cells[measure.name] = _measure_signal(measure, run, window)
    return cells


def _resolve_window(
    since: Bound, until: Bound, cells: Mapping[str, Cell], horizon: float
) -> Window:
    """Return start and end [s] of a window; None if an end is a measure without a value.

    A missing bound means 0 or the horizon.
    """
    ends = []
    for bound, default in ((since, 0.0), (until, horizon)):
        value = cells[bound] if isinstance(bound, str) else bound
        if isinstance(bound, str) and value is None:
            return None
        ends.append(default if value is None else float(value))  # type: ignore[arg-type]
    return ends[0], ends[1]


def _times_within(times: Sequence[float], window: Window) -> list[float]:
    """Return the times in a closed window; empty without a window."""
    return [] if window is None else [t for t in times if window[0] <= t <= window[1]]


def _measure_event(measure: EventMeasure, run: Observation, window: Window) -> Cell:
    """Return the time [s] of the n-th event in the window, or the number of events."""
    times = _times_within(run.times_of(measure.event), window)
    if measure.kind == "count":
        return None if window is None else len(times)
    return times[measure.number - 1] if len(times) >= measure.number else None


def _measure_delay(measure: DelayMeasure, run: Observation, window: Window) -> Cell:
    """Return the delay [s] of the first event in the allowed interval around the n-th reference
    event.

    Return None if there is no such event.
    """
    truths = _times_within(run.times_of(measure.after), window)
    if len(truths) < measure.number:
        return None
    truth = truths[measure.number - 1]
    last = math.inf if measure.within is None else float(measure.within)
    for time in run.times_of(measure.event):
        if -float(measure.before) <= time - truth <= last:
            return time - truth
    return None


def _measure_match(measure: MatchMeasure, run: Observation, window: Window) -> dict[str, Cell]:
    """Return the columns of a match: each truth takes the first unused detection in its window."""
    before, within = float(measure.before), measure.within
    longest = math.inf if within is None else float(within)
    intervals = run.dwell_intervals(measure.truth)
    spans = [(start, start - before, min(end, start + longest)) for start, end in intervals]
    times = run.times_of(measure.event)
    detections = _times_within(times, window)
    counted = [s for s in spans if window is not None and window[0] <= s[0] <= window[1]]
    unmatched = list(times)
    delays: list[float] = []
    firsts: list[float | None] = []
    for start, low, high in counted:
        detection = next((time for time in unmatched if low <= time <= high), None)
        firsts.append(None if detection is None else detection - start)
        if detection is not None:
            unmatched.remove(detection)
            delays.append(detection - start)
    near = [(start - before, end + before) for start, end in intervals]
    false = sum(not any(low <= t <= high for low, high in near) for t in detections)
    name = measure.name
    return {
        f"{name}.truths": len(counted),
        f"{name}.matched": len(delays),
        f"{name}.missed": len(counted) - len(delays),
        f"{name}.detections": len(detections),
        f"{name}.false_events": false,
        f"{name}.first": firsts[0] if firsts else None,
        f"{name}.first_missed": int(firsts[0] is None) if firsts else None,
        f"{name}.delays": delays,
    }


def _measure_signal(measure: SignalMeasure, run: Observation, window: Window) -> Cell:
    """Return the statistic of a signal in the window; None without a window or rows."""
    if window is None:
        return None
    inside = (run.times >= window[0]) & (run.times <= window[1])
    return evaluate_signal(measure, run.times[inside], run.signals[measure.signal][inside])


def _measure_value(measure: ValueMeasure, cells: Mapping[str, Cell]) -> Cell:
    """Return the value of an expression of measures.

    Return None if it refers to an undefined measure or if the result is not finite.
    """
    read: dict[str, float] = {}
    for name in dict.fromkeys(measure.formula.reads):
        cell = cells[name]
        if cell is None or isinstance(cell, list):
            return None
        read[name] = cell if isinstance(cell, bool) else float(cell)
    operands = {name: Ref(name) for name in read}
    if measure.is_truth:
        return bool(evaluate(lower_expression(measure.formula.tree, operands), read))
    value = float(evaluate(lower_assigned_value(measure.formula.tree, operands, False), read))
    return value if math.isfinite(value) else None
