"""Batch: many variants of one system and scenario in one call, and their results.

A variant has its own parameters, initial values, inputs and seed. The result has the statistics,
the events and the outputs that the batch selects. A `BatchRunner` executes a batch: the interpreter
(engine/batch/interpreted_batch.py) or compiled C (engine/batch/compiled_batch.py), with the same
bits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from engine.results.array_types import Reals
from language.ir.root_region import CHART
from language.model.system import Scenario, Stimulus, System

StatisticKind = Literal["first", "final", "max", "min", "peak", "mean", "rms"]
"""Kind of a statistic of a signal."""
NO_EVENT = -1
"""Value in `BatchResult.event_kinds` after the last event of a variant."""


@dataclass(frozen=True)
class SignalStatistic:
    """Statistic of a signal over its rows from `since` to `until` [s], ends included.

    `peak` is the largest magnitude. Rows are those of the scenario's `record`. The statistic is NaN
    without rows in the span, or with a NaN among them.
    """

    name: str
    signal: str
    kind: StatisticKind
    since: Fraction = Fraction(0)
    until: Fraction | None = None


@dataclass(frozen=True)
class InputTable:
    """Input that steps at `starts` [s] (k,), the first 0, to `values` [SI] (count, k)."""

    starts: tuple[Fraction, ...]
    values: Reals


@dataclass(frozen=True)
class Batch:
    """Variants of a system through a scenario; `count` is their number.

    `parameters` are values [SI] (count,) by `instance.parameter`, `initial` initial values by
    `instance.state`, `inputs` the system inputs that differ, and `seeds` (count,) the seeds of
    noise. `variant_inputs` are stimuli of each variant that step at different times; in C each
    variant has its own plan, and all share one Program. `statistics` and `outputs` are the selected
    results. Of each variant `max_events` events are kept, and all are counted.
    """

    system: System
    scenario: Scenario
    count: int
    parameters: Mapping[str, Reals] = field(default_factory=dict)
    initial: Mapping[str, Reals] = field(default_factory=dict)
    inputs: Mapping[str, InputTable] = field(default_factory=dict)
    seeds: NDArray[np.int64] | None = None
    variant_inputs: Sequence[Mapping[str, Stimulus]] = ()
    statistics: tuple[SignalStatistic, ...] = ()
    outputs: tuple[str, ...] = ()
    max_events: int = 0


@dataclass(frozen=True)
class EventKind:
    """Kind of event: a transition with its modes; range and invariant violations have no modes."""

    instance: str
    transition: str
    source: str = ""
    target: str = ""
    region: str = CHART
    kind: Literal["transition", "range", "invariant"] = "transition"


@dataclass(frozen=True)
class BatchResult:
    """Results of all variants, in the order of the batch.

    `statistics` (count,) by name; `outputs` (count, rows) by signal at `times` [s] (rows,), NaN
    after the end of a run that stopped; `event_counts` (count,); `event_times` [s] and
    `event_kinds` (count, max_events), the latter as indices of `kinds`. `faults` are the latched
    fault bits as `instance: fault`, `stopped` the reasons why variants ended before the horizon,
    both by variant. `note` names the executor.
    """

    statistics: Mapping[str, Reals]
    outputs: Mapping[str, Reals]
    times: Reals
    kinds: tuple[EventKind, ...]
    event_counts: NDArray[np.int64]
    event_times: Reals
    event_kinds: NDArray[np.int32]
    faults: Mapping[int, tuple[str, ...]]
    stopped: Mapping[int, str]
    note: str = ""


class BatchRunner(Protocol):
    """Executor of batches; results do not depend on the executor or on the number of threads."""

    def __call__(self, batch: Batch) -> BatchResult:
        """Return the results of all variants."""
