"""Channel check: rate, gaps, quantisation, noise and stuck values of one recorded channel."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.data.array_types import Reals
from diagnosis.data_quality.finding import Finding, Severity
from engine.recordings.recording import Channel, Recording

Interval = tuple[float, float]
"""Start and end of an interval [s]."""
GAP_FACTOR = 1.5
"""A time step above this multiple of the median step has lost samples."""
LONG_GAP_FACTOR = 10.0
"""Multiple of the median step above which a gap is reported with its place."""
MUCH_DROPPED, SOME_DROPPED = 0.10, 0.01
"""Fractions of lost samples that are an error and a warning."""
JITTER_FRACTION = 0.5
"""Fraction of the median step above which jitter is reported."""
MUCH_REPEATED = 0.08
"""Fraction of repeated values, beyond the effect of quantisation, from which it is reported."""
MAX_REPETITIONS = 4
"""Longest run of repetitions that counts; in a longer one the signal is constant."""
STUCK_SAMPLES, STUCK_TIME = 25, 0.2
"""Samples and seconds for which a noisy signal must keep one value to count as stuck."""
CLIPPED_FRACTION = 0.01
"""Fraction of samples at the largest or smallest value from which a signal may be clipped."""
MIN_SAMPLES = 10
"""Smallest number of samples for which a property of a channel is estimated or compared."""
QUANTUM_TOLERANCE = 0.02
"""Largest distance, in quanta, of changes from whole multiples of the quantum (rounding)."""


@dataclass(frozen=True)
class ChannelCheck:
    """Properties of one channel; times in s, values in SI (`factor` times those in `unit`).

    `rate` [1/s] and `jitter` (95th percentile [s]) are of steps without lost samples; `dropped`,
    `repeated` and `clipped` are fractions of samples. `quantum` is 0 without quantisation.
    """

    recording: str
    name: str
    signal: str
    unit: str
    factor: float
    samples: int
    start: float
    end: float
    rate: float
    jitter: float
    dropped: float
    gaps: tuple[Interval, ...]
    quantum: float
    noise: float
    low: float
    high: float
    repeated: float
    clipped: float
    stuck: Interval | None


def check_channel(recording: Recording, channel: Channel) -> ChannelCheck:
    """Return the properties of a channel with values; those that need more values are 0."""
    times, values = channel.seconds, channel.array
    steps = np.diff(times)
    usual = float(np.median(steps)) if len(steps) else 0.0
    lost = np.maximum(np.round(steps / usual) - 1.0, 0.0) if usual else np.zeros(0)
    lost[steps <= GAP_FACTOR * usual] = 0.0
    even = steps[steps <= GAP_FACTOR * usual]
    long = np.flatnonzero(steps > LONG_GAP_FACTOR * usual)
    quantum = _quantum(values)
    noise = _noise(times, values, usual)
    return ChannelCheck(
        recording=recording.name,
        name=channel.column.name,
        signal=channel.column.to or channel.column.compare or channel.column.name,
        unit=channel.column.unit.text,
        factor=si_factor(channel),
        samples=len(values),
        start=float(times[0]),
        end=float(times[-1]),
        rate=1.0 / float(even.mean()) if len(even) else 0.0,
        jitter=float(np.percentile(np.abs(even - usual), 95)) if len(even) else 0.0,
        dropped=float(lost.sum() / (lost.sum() + len(values))),
        gaps=tuple((float(times[k]), float(times[k + 1])) for k in long),
        quantum=quantum,
        noise=noise,
        low=float(values.min()),
        high=float(values.max()),
        repeated=_repeated_fraction(values, quantum, noise),
        clipped=_clipped_fraction(values, quantum, noise),
        stuck=_stuck_interval(times, values, quantum, noise),
    )


def si_factor(channel: Channel) -> float:
    """Return the factor from the unit of the file to SI."""
    return float(channel.column.unit.factor * channel.column.scale[0])


def channel_findings(check: ChannelCheck, is_compared: bool) -> list[Finding]:
    """Return the findings on a channel, at most three of them gaps, in a fixed order of kinds."""
    findings: list[Finding] = []

    def report(kind: str, text: str, severity: Severity, window: Interval | None = None) -> None:
        findings.append(Finding(kind, check.recording, check.name, text, severity, window))

    if check.low == check.high and is_compared:
        report("no_signal", f"is {check.low:g} all the time: the signal is missing", "error")
    severity: Severity
    if check.dropped >= SOME_DROPPED:
        severity = "error" if check.dropped >= MUCH_DROPPED else "warning"
        report("dropped", f"{check.dropped:.0%} of its samples are missing", severity)
    for start, end in check.gaps[:3]:
        report("gap", f"has no value for {end - start:.3g} s", "warning", (start, end))
    if check.jitter * check.rate > JITTER_FRACTION:
        report("jitter", f"its steps of time vary by {check.jitter * 1e3:.2g} ms", "note")
    if check.repeated >= MUCH_REPEATED:
        severity = "error" if check.repeated >= MUCH_DROPPED else "warning"
        text = f"{check.repeated:.0%} of its values repeat the one before, more than its step"
        report("repeated", f"{text} of {check.quantum:.3g} explains: samples were held", severity)
    if check.stuck:
        start, end = check.stuck
        text = f"stands still for {end - start:.3g} s, from {start:.3g} s on, though it is noisy"
        report("stuck", text, "warning", check.stuck)
    if check.clipped >= CLIPPED_FRACTION:
        text = f"{check.clipped:.0%} of its values are exactly at its end: it may be clipped"
        report("clipped", text, "warning")
    return findings


def _quantum(values: Reals) -> float:
    """Return the quantisation step, of which 97 % of small changes are multiples; 0 without one."""
    changes = np.abs(np.diff(values))
    scale = float(np.abs(values).max())
    changes = changes[changes > 1e-9 * scale]
    if len(changes) < MIN_SAMPLES:
        return 0.0
    least = float(np.percentile(changes, 0.1, method="lower"))
    multiples = changes / least
    off = np.abs(multiples - np.round(multiples))
    small = multiples < 0.2 / QUANTUM_TOLERANCE
    fits = off[small] < QUANTUM_TOLERANCE
    return least if len(fits) >= MIN_SAMPLES and float(fits.mean()) > 0.97 else 0.0


def _noise(times: Reals, values: Reals, period: float) -> float:
    """Return the standard deviation of white noise from third differences at even steps."""
    if len(values) < MIN_SAMPLES:
        return 0.0
    third = np.diff(values, 3)
    even = np.abs(np.diff(times) / period - 1.0) < 0.2
    whole = even[:-2] & even[1:-1] & even[2:]
    kept = third[whole] if whole.sum() >= MIN_SAMPLES else third
    spread = float(np.median(np.abs(kept)))
    return 1.4826 * spread / math.sqrt(20.0)


def _repeated_fraction(values: Reals, quantum: float, noise: float) -> float:
    """Return the fraction of values equal to the previous one, beyond quantisation.

    White noise s with quantum q has equal neighbours with probability q / (2 sqrt(pi) s).
    """
    changes = np.abs(np.diff(values))
    changes = changes[changes > 0.0]
    if len(changes) < MIN_SAMPLES:
        return 0.0
    step = max(quantum, float(np.percentile(changes, 1.0)))  # rounding may hide the quantum
    if noise <= step:
        return 0.0
    by_chance = step / (2.0 * math.sqrt(math.pi) * noise)
    runs = [last - first for first, last in _runs_of_equal(np.diff(values) == 0.0)]
    share = sum(run for run in runs if run <= MAX_REPETITIONS) / (len(values) - 1)
    return max(0.0, (share - by_chance) / (1.0 - by_chance))


def _runs_of_equal(equal: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the first index and the end index of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], equal.astype(int), [0]))))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _stuck_interval(times: Reals, values: Reals, quantum: float, noise: float) -> Interval | None:
    """Return the longest interval with one nonzero value in a noisy channel; None if short."""
    if noise <= 0.5 * quantum or noise <= 0.0:
        return None
    runs = [run for run in _runs_of_equal(np.diff(values) == 0.0) if values[run[0]] != 0.0]
    if not runs:
        return None
    first, last = max(runs, key=lambda run: run[1] - run[0])
    is_long = last - first >= STUCK_SAMPLES and times[last] - times[first] >= STUCK_TIME
    return (float(times[first]), float(times[last])) if is_long else None


def _clipped_fraction(values: Reals, quantum: float, noise: float) -> float:
    """Return the fraction of values exactly at an extreme with fewer values near it; 0 if none."""
    span = float(values.max() - values.min())
    shares = [0.0]
    for end in (float(values.max()), float(values.min())):
        at_end = np.abs(values - end) < 1e-9 * span
        beside = (np.abs(values - end) < 0.03 * span) & ~at_end
        longest = max((b - a for a, b in _runs_of_equal(at_end)), default=0)
        if end != 0.0 and longest >= 5 and noise > 0.3 * quantum and at_end.sum() > beside.sum():
            shares.append(float(at_end.mean()))
    return max(shares)
