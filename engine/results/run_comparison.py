"""Run comparison: differences of two runs by signal, and times at which their modes differ."""

from __future__ import annotations

import fnmatch
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from engine.results.array_types import Reals
from engine.results.resampling import hold_previous, resample_signal
from engine.results.sampled_run import matches_any
from engine.results.time_alignment import NO_SHIFT, TimeShift, find_time_shift, shift_times
from engine.results.trajectory import Trajectory
from language.ir.root_region import CHART
from language.text.diagnostic import DataError

MAX_NAMES = 5
"""Largest number of signals of a run that a message lists."""


@dataclass(frozen=True)
class SignalDifference:
    """Difference of one signal: RMS, largest difference, its time [s], and the allowed difference.

    `first` is the first time [s] above `allowed`, else None. Values are in the SI unit of the
    signal; they are infinite where only one value is a number.
    """

    name: str
    unit: str
    rms: float
    largest: float
    at: float
    allowed: float
    first: float | None


@dataclass(frozen=True)
class ModeWindow:
    """Time interval [s] in which a mode signal differs, with both mode names."""

    signal: str
    start: float
    end: float
    a: str
    b: str


@dataclass(frozen=True)
class ModeSequence:
    """Comparison of the transitions of one automaton or region in both runs.

    `first_difference` is the index of the first transition that differs (None if none does).
    `largest_time_difference` [s] is that of corresponding transitions before that.
    """

    instance: str
    count_a: int
    count_b: int
    first_difference: int | None
    largest_time_difference: float


@dataclass(frozen=True)
class RunDifference:
    """All differences of two runs over their common span [s].

    `only_a` and `only_b` are signals of one run; `uncovered` [s] is the time that only one run
    covers. `renamed_instance` is the name of the only instance of run B if its signals are compared
    with those of an instance of another name, such as the base of a variant; else "". `shift` is
    the time that was added to the times of run B.
    """

    span: tuple[float, float]
    samples: int
    signals: tuple[SignalDifference, ...]
    windows: tuple[ModeWindow, ...]
    sequences: tuple[ModeSequence, ...]
    only_a: tuple[str, ...]
    only_b: tuple[str, ...]
    uncovered: float
    renamed_instance: str = ""
    shift: TimeShift = NO_SHIFT

    @property
    def is_within(self) -> bool:
        """Return whether all signals are within tolerance and nothing is missing.

        Windows of different modes, different transitions, and time or signals of one run alone make
        the result False.
        """
        missing = self.only_a or self.only_b or self.uncovered > 0.0 or self.windows
        parted = any(sequence.first_difference is not None for sequence in self.sequences)
        return not missing and not parted and all(item.first is None for item in self.signals)

    @property
    def first(self) -> tuple[float, str] | None:
        """First time [s] and name of a signal above its tolerance or a mode that differs.

        None if there is none; of several at one time, the first name in the alphabet.
        """
        differences = [(item.first, item.name) for item in self.signals if item.first is not None]
        differences += [(window.start, window.signal) for window in self.windows]
        return min(differences, default=None)


def compare_runs(
    a: Trajectory,
    b: Trajectory,
    *,
    relative: float = 0.0,
    tolerances: Mapping[str, float] | None = None,
    slack: float = 0.0,
    patterns: Sequence[str] = (),
    span: tuple[float, float] | None = None,
    offset: float | None = 0.0,
) -> RunDifference:
    """Compare two runs at the samples of `a`; `b` is interpolated if it has other samples.

    `offset` [s] is added to the times of `b` first; None finds it by correlation
    (`find_time_shift`). Signals that one of the runs states as piecewise constant are held.

    Signals are compared by name. Two runs of one instance each may have different names of the
    instance (`rename_instance`), as the runs of an automaton and of its variant have.
    `patterns` (fnmatch) select signals, `span` [s] limits the time. A signal may differ by the
    larger of `relative` times its peak in `a` and its tolerances (patterns of names with values in
    SI); without both by nothing. Windows of different modes up to `slack` [s] are left out. Raises
    DataError for runs without common time or signal, for different units, and for runs that do not
    correlate; ValueError for a tolerance that matches no common signal, and for one that is
    negative or not finite.
    """
    _require_tolerances({"relative": relative, "slack": slack, **(tolerances or {})})
    if offset is not None and not np.isfinite(offset):
        raise ValueError(f"the offset is {offset}: it is a finite time")
    original, b = b, rename_instance(b, a)
    is_named_alike = b is original
    held = a.piecewise_constant | b.piecewise_constant
    a, b = replace(a, piecewise_constant=held), replace(b, piecewise_constant=held)
    shift = find_time_shift(a, b, patterns) if offset is None else TimeShift(offset)
    b = shift_times(b, shift.offset)
    names = [name for name in a.signals if matches_any(name, patterns)]
    common = [name for name in names if name in b.signals]
    times, uncovered = _common_times(a, b, span)
    _require_comparable(a, b, common, tolerances or {})
    modes = [name for name in common if name in a.modes or name in b.modes]
    signals = []
    for name in common:
        if name not in modes:
            allowed = _tolerance_of(name, a, relative, tolerances or {})
            signals.append(_compare_signal(name, a, b, times, allowed))
    windows = [window for name in modes for window in _mode_windows(name, a, b, times)]
    bounds = (float(times[0]), float(times[-1]))
    return RunDifference(
        span=bounds,
        samples=len(times),
        signals=tuple(signals),
        windows=tuple(window for window in windows if window.end - window.start > slack),
        sequences=tuple(_compare_mode_sequences(a, b, common, bounds)),
        only_a=tuple(name for name in names if name not in b.signals),
        only_b=tuple(n for n in b.signals if n not in a.signals and matches_any(n, patterns)),
        uncovered=uncovered,
        renamed_instance="" if is_named_alike else next(iter(_instances(original))),
        shift=shift,
    )


def rename_instance(run: Trajectory, other: Trajectory) -> Trajectory:
    """Return a run with its only instance under the name of the only instance of another run.

    The run is returned as it is if one of them has no instance or several, and if no signal is in
    both runs afterwards.
    """
    old, new = _instances(run), _instances(other)
    if len(old) != 1 or len(new) != 1 or old == new:
        return run
    (before,), (after,) = old, new

    def rename(name: str) -> str:
        """Return the name of a signal with the new name of the instance."""
        return f"{after}.{name.removeprefix(before + '.')}" if "." in name else name

    if not any(rename(name) in other.signals for name in run.signals):
        return run
    return replace(
        run,
        signals={rename(name): values for name, values in run.signals.items()},
        units={rename(name): unit for name, unit in run.units.items()},
        modes={rename(name): modes for name, modes in run.modes.items()},
        events=tuple(replace(event, instance=after) for event in run.events),
        piecewise_constant=frozenset(map(rename, run.piecewise_constant)),
    )


def _instances(run: Trajectory) -> set[str]:
    """Return the names of the instances whose signals a run has."""
    return {name.partition(".")[0] for name in run.signals if "." in name}


def _common_times(
    a: Trajectory, b: Trajectory, span: tuple[float, float] | None
) -> tuple[Reals, float]:
    """Return the sample times [s] of `a` in the common span, and the time that is not common.

    The second value [s] is the time that one run alone covers. Raises DataError if a run has no
    samples or the runs have no time in common, and ValueError if they have none in the span.
    """
    if not len(a.times) or not len(b.times):
        raise DataError("a run without samples cannot be compared")
    limits = span or (-np.inf, np.inf)
    starts = [max(float(run.times[0]), limits[0]) for run in (a, b)]
    ends = [min(float(run.times[-1]), limits[1]) for run in (a, b)]
    times = a.times[(a.times >= max(starts)) & (a.times <= min(ends))]
    if not len(times):
        has_common_time = max(run.times[0] for run in (a, b)) <= min(
            run.times[-1] for run in (a, b)
        )
        if span and has_common_time:
            raise ValueError(f"the runs have no sample from {span[0]:g} s to {span[1]:g} s")
        raise DataError("the runs have no time in common")
    return times, max(starts) - min(starts) + max(ends) - min(ends)


def _require_tolerances(values: Mapping[str, float]) -> None:
    """Raise ValueError for a tolerance, by name, that is negative or not finite."""
    for name, value in values.items():
        if not 0.0 <= value < np.inf:
            raise ValueError(f"the tolerance `{name}` is {value}: it is finite and at least 0")


def _require_comparable(
    a: Trajectory, b: Trajectory, common: Sequence[str], tolerances: Mapping[str, float]
) -> None:
    """Raise DataError for runs without common signal or with different units.

    Raises ValueError for a tolerance that matches no signal.
    """
    if not common:
        names = (", ".join(list(run.signals)[:MAX_NAMES]) or "none" for run in (a, b))
        text = "the runs have no signal in common: the signals of A are {}; those of B are {}"
        raise DataError(text.format(*names))
    for name in common:
        if a.units[name] != b.units[name]:
            raise DataError(f"`{name}` is in `{a.units[name]}` and in `{b.units[name]}`")
    for pattern in tolerances:
        if not fnmatch.filter(common, pattern):
            raise ValueError(f"no common signal matches the tolerance of `{pattern}`")


def _tolerance_of(
    name: str, run: Trajectory, relative: float, tolerances: Mapping[str, float]
) -> float:
    """Return the allowed difference of a signal in SI: the largest that applies."""
    values = np.abs(run.signals[name].astype(np.float64))
    peak = float(np.max(values, initial=0.0, where=np.isfinite(values)))
    matching = [
        value for pattern, value in tolerances.items() if fnmatch.fnmatchcase(name, pattern)
    ]
    return max([relative * peak, *matching])


def _compare_signal(
    name: str, a: Trajectory, b: Trajectory, times: Reals, allowed: float
) -> SignalDifference:
    """Return the difference of a signal at some times; two NaNs are equal."""
    values_a, values_b = resample_signal(a, name, times), resample_signal(b, name, times)
    same = (values_a == values_b) | (np.isnan(values_a) & np.isnan(values_b))
    with np.errstate(invalid="ignore", over="ignore"):
        deviation = np.where(same, 0.0, np.abs(values_a - values_b))
        deviation = np.where(np.isnan(deviation), np.inf, deviation)
        rms = float(np.sqrt(np.mean(deviation**2)))
    beyond = np.flatnonzero(deviation > allowed)
    worst = int(np.argmax(deviation))
    first = float(times[beyond[0]]) if len(beyond) else None
    largest = float(deviation[worst])
    return SignalDifference(name, a.units[name], rms, largest, float(times[worst]), allowed, first)


def _mode_windows(name: str, a: Trajectory, b: Trajectory, times: Reals) -> list[ModeWindow]:
    """Return the intervals in which a mode signal differs.

    Adjacent ones with equal modes are merged.
    """
    names_a = _mode_names(a, b, name, times)
    names_b = _mode_names(b, a, name, times)
    windows: list[ModeWindow] = []
    for k, (mode_a, mode_b) in enumerate(zip(names_a, names_b, strict=True)):
        if mode_a == mode_b:
            continue
        end = float(times[min(k + 1, len(times) - 1)])
        last = windows[-1] if windows else None
        if last and last.end == times[k] and (last.a, last.b) == (mode_a, mode_b):
            windows[-1] = ModeWindow(name, last.start, end, mode_a, mode_b)
        else:
            windows.append(ModeWindow(name, float(times[k]), end, mode_a, mode_b))
    return windows


def _mode_names(run: Trajectory, other: Trajectory, name: str, times: Reals) -> list[str]:
    """Return the mode names of a signal at some times.

    Names of the other run replace missing ones.
    """
    names = run.modes.get(name) or other.modes[name]
    values = run.signals[name]
    numbers = (
        values
        if run.times.tobytes() == times.tobytes()
        else hold_previous(run.times, values, times)
    )
    return [names.get(int(number), str(number)) for number in numbers]


def _compare_mode_sequences(
    a: Trajectory, b: Trajectory, common: Sequence[str], span: tuple[float, float]
) -> list[ModeSequence]:
    """Return the comparisons of transitions of each automaton and region.

    The result is empty if a run has no mode names.
    """
    if not a.modes or not b.modes:
        return []  # a run of samples alone has no events to compare
    compared = {name.rpartition(".")[0] for name in common}
    parts = dict.fromkeys((event.instance, event.region) for event in (*a.events, *b.events))
    sequences = []
    for instance, region in parts:
        if compared != {""} and instance not in compared:
            continue
        events_a, events_b = (
            [
                event
                for event in run.events
                if (event.instance, event.region) == (instance, region)
                and span[0] <= event.time <= span[1]
            ]
            for run in (a, b)
        )
        pairs = list(zip(events_a, events_b, strict=False))
        same = next(
            (k for k, (x, y) in enumerate(pairs) if (x.source, x.target) != (y.source, y.target)),
            len(pairs),
        )
        parted = None if same == len(events_a) == len(events_b) else same
        time_distance = max((abs(x.time - y.time) for x, y in pairs[:same]), default=0.0)
        name = instance if region == CHART else f"{instance}.{region}"
        sequences.append(ModeSequence(name, len(events_a), len(events_b), parted, time_distance))
    return sequences
