"""Batch: many variants of one system and scenario in one call - what goes in, what comes out.

A variant has its own parameters, initial values, inputs and seed. Of each variant only the
measures, the events and the outputs that were asked for are kept. Who carries a batch out is a
`Runner`: the interpreter (engine/batch/interpreted_batch.py) or compiled C, same protocol, same bits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from language.ir.regions import CHART
from language.model.system import Scenario, Stimulus, System

Reals = NDArray[np.float64]
StatisticKind = Literal["first", "final", "max", "min", "peak", "mean", "rms"]
NO_EVENT = -1
"""What fills `BatchResult.event_kinds` behind the last event of a variant."""


@dataclass(frozen=True)
class SignalStatistic:
    """One number of a signal over its rows from `since` to `until` [s], ends included.

    `peak` is the largest magnitude. Rows are those of the scenario's `record`. Without rows in the
    span, or with a NaN among them, it is NaN.
    """

    name: str
    signal: str
    kind: StatisticKind
    since: Fraction = Fraction(0)
    until: Fraction | None = None


@dataclass(frozen=True)
class InputTable:
    """An input that steps at `starts` [s] (k,), the first 0, to `values` [SI] (count, k)."""

    starts: tuple[Fraction, ...]
    values: Reals


@dataclass(frozen=True)
class Batch:
    """Variants of a system through a scenario, `count` of them.

    `parameters` are values [SI] (count,) by `instance.parameter`, `initial` start values by
    `instance.state`, `inputs` those of the system that differ, `seeds` (count,) those of noise.
    `courses` are inputs of each variant that step at other times than those of the others: in C
    each of them has a plan of its own, all have one Program.
    `outputs` are recorded signals to keep whole; `most_events` is how many events are kept of each
    variant: all are counted.
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
    """What can happen: a transition with its modes; a range left or an invariant has none."""

    instance: str
    transition: str
    source: str = ""
    target: str = ""
    region: str = CHART
    kind: Literal["transition", "range", "invariant"] = "transition"


@dataclass(frozen=True)
class BatchResult:
    """What is kept of each variant, in the order of the batch.

    `measures` (count,) by name; `outputs` (count, rows) by signal over `times` (rows,), NaN behind
    the end of a run that stopped; `event_counts` (count,); `event_times` [s] and `event_kinds`
    (count, most_events), places in `kinds`; `faults`: which fault bits were set, as `instance:
    fault`, and `stopped`: why a variant ended before the horizon, both by its number. `note` says
    what did the work.
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
    """What carries a batch out; results do not depend on which one does, nor on threads."""

    def __call__(self, batch: Batch) -> BatchResult:
        """Return what is kept of each variant."""
