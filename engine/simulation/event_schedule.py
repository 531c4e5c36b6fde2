"""Event schedule: the instants at which something happens in a system, in exact time (rule 19b)."""

from __future__ import annotations

import heapq
import itertools
import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction

from language.ir.program import Program
from language.model.system import Scenario, Stimulus, System
from language.text.diagnostic import LargeRunWarning, Problem, SpecError

MAX_INSTANTS = 100_000_000
"""Largest number of ticks, samples and rows of a run: about an hour of interpretation."""

LARGE_ROW_COUNT = 10_000_000
"""Number of recorded rows above which a run is announced: 80 MB for each signal."""


class TimeGrid:
    """Instants `start`, `start + period`, `start + 2 period`, ... that are not negative [s]."""

    def __init__(self, start: Fraction, period: Fraction) -> None:
        """Take the first instant [s], which may be negative, and the period [s]."""
        self.period = period
        self.start = start if start >= 0 else start + -(start // period) * period

    def has(self, time: Fraction) -> bool:
        """Return whether a time [s] is exactly one of the instants."""
        return time >= self.start and (time - self.start) % self.period == 0

    def count(self, horizon: Fraction) -> int:
        """Return the number of instants up to the horizon [s], end included; 0 before the first."""
        return max(0, int((horizon - self.start) // self.period) + 1)

    def __iter__(self) -> Iterator[Fraction]:
        """Yield the instants in order, without end."""
        whole = math.lcm(self.start.denominator, self.period.denominator)
        start, period = int(self.start * whole), int(self.period * whole)
        return (Fraction(start + k * period, whole) for k in itertools.count())


class Schedule:
    """Instants of ticks, samples, captures, arrivals and events of a scenario.

    `rows` are the times of recorded rows. `captures` are the times at which a delayed sensor or
    signal stores its source.
    """

    def __init__(self, system: System, scenario: Scenario, programs: dict[str, Program]) -> None:
        """Take a resolved scenario. Raises SpecError for more than `MAX_INSTANTS` instants."""
        assert scenario.horizon is not None
        self.horizon = scenario.horizon
        self.rows = TimeGrid(Fraction(0), scenario.every)
        self.ticks = {
            name: TimeGrid(system.instances[name].offset, program.period)
            for name, program in programs.items()
            if program.period is not None
        }
        self.samples: dict[str, TimeGrid] = {}
        self.captures: dict[str, list[TimeGrid]] = {}
        for name, sensor in system.sensors.items():
            if sensor.period is not None:
                self.samples[name] = TimeGrid(sensor.offset, sensor.period)
                if sensor.delay:
                    late = TimeGrid(sensor.offset - sensor.delay, sensor.period)
                    self.captures[name] = [late]
        self._arrivals: list[TimeGrid] = []
        for connection in system.connections.values():
            for line in (
                system.delayed_signals[read]
                for read in connection.reads
                if read in system.delayed_signals
            ):
                reader, owner = connection.target[0], line.source.partition(".")[0]
                captures = self.captures.setdefault(line.name, [])
                ticking = self.ticks.get(owner) or self.samples.get(line.source)
                if reader in self.ticks and ticking is None and line.source not in system.inputs:
                    reader_ticks = self.ticks[reader]
                    captures.append(TimeGrid(reader_ticks.start - line.delay, reader_ticks.period))
                elif reader not in self.ticks and ticking is not None:
                    self._arrivals.append(TimeGrid(ticking.start + line.delay, ticking.period))
        pages = (page.time for page in scenario.calibrations)
        self.events = _sort_unique([*pages, *_input_event_times(system, scenario.inputs)])
        self._require_bounded(scenario)

    @property
    def _grids(self) -> list[TimeGrid]:
        """All grids whose times are instants."""
        captures = [grid for grids in self.captures.values() for grid in grids]
        return [*self.ticks.values(), *self.samples.values(), *captures, *self._arrivals]

    def grids(self) -> dict[str, TimeGrid]:
        """Return the grids of ticks, samples and captures by name; a capture is `capture <name>`.

        Of several captures of a signal the first is returned. Arrivals of delayed outputs have no
        grid here, so the result is meant for systems without them.
        """
        late = {f"capture {n}": grids[0] for n, grids in self.captures.items() if grids}
        return {**self.ticks, **self.samples, **late}

    def instants(self) -> Iterator[Fraction]:
        """Yield every instant from 0 to the horizon [s] in order, each once.

        Both ends are instants. The others are ticks, samples, captures, arrivals, starts of input
        pieces and calibrations; rows are none.
        """
        last = None
        ends = (Fraction(0), self.horizon)
        for time in heapq.merge(ends, self.events, *self._grids):
            if time > self.horizon:
                return
            if time != last:
                yield time
            last = time

    def captures_at(self, time: Fraction) -> list[str]:
        """Return the delayed sensors and signals that store their source at an instant [s]."""
        return [n for n, grids in self.captures.items() if any(grid.has(time) for grid in grids)]

    def _require_bounded(self, scenario: Scenario) -> None:
        """Raise SpecError for more than `MAX_INSTANTS` instants and rows.

        Warns (LargeRunWarning) about more than LARGE_ROW_COUNT rows.
        """
        count = sum(grid.count(self.horizon) for grid in (self.rows, *self._grids))
        if count > MAX_INSTANTS:
            label = f"the scenario has {count} ticks and rows; at most {MAX_INSTANTS} are run"
            raise SpecError([Problem("range", scenario.span, label, "a shorter `horizon`")])
        rows = self.rows.count(self.horizon)
        if rows > LARGE_ROW_COUNT:
            text = f"{scenario.span}: the run records {rows} rows, {rows * 8 / 1e6:.0f} MB for each"
            hint = "signal; a longer `every` of `record`, or fewer signals, needs less"
            warnings.warn(f"{text} {hint}", LargeRunWarning, stacklevel=2)


def _sort_unique(times: Sequence[Fraction]) -> list[Fraction]:
    """Return times in increasing order, each once.

    They are compared as integers over their common denominator, which is faster than fractions.
    """
    bottom = math.lcm(*(time.denominator for time in times))
    ticks = {time.numerator * (bottom // time.denominator): time for time in times}
    return [ticks[tick] for tick in sorted(ticks)]


def _input_event_times(system: System, inputs: Mapping[str, Stimulus]) -> Iterator[Fraction]:
    """Yield the times [s] at which pieces of inputs start and at which delayed ones arrive."""
    for name, stimulus in inputs.items():
        delays = [line.delay for line in system.delayed_signals.values() if line.source == name]
        for piece in stimulus.pieces:
            if piece.start.numerator > 0:
                yield piece.start
            yield from (piece.start + delay for delay in delays if piece.start + delay > 0)
