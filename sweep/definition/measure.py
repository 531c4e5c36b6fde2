"""Measures: define the quantities that a study computes from each variant.

A measure is an event time, a count, a delay, a match of events, a statistic of a signal or an
expression of other measures.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

from language.expressions.units import display_unit
from language.loading.mode_entry_event import ModeEntryEvent
from language.model.declaration import Formula
from language.text.diagnostic import Span

SignalKind = Literal["peak", "max", "min", "mean", "rms", "final", "settling", "frequency"]
Bound = Fraction | str | None
"""An end of a time window: a time [s], the name of an earlier measure, or None for no limit."""


@dataclass(frozen=True)
class EventMeasure:
    """The time [s] of the n-th event in a window, or the number of events."""

    name: str
    kind: Literal["time", "count"]
    event: ModeEntryEvent
    number: int
    since: Bound
    until: Bound
    unit: str
    span: Span


@dataclass(frozen=True)
class DelayMeasure:
    """The delay [s] from the n-th `after` event to the first `event` not earlier than `before`.

    The delay is negative if the event comes first. It is None without such an event, or if it is
    later than `within` [s].
    """

    name: str
    event: ModeEntryEvent
    after: ModeEntryEvent
    number: int
    before: Fraction
    within: Fraction | None
    since: Bound
    until: Bound
    unit: str
    span: Span


@dataclass(frozen=True)
class MatchMeasure:
    """A comparison of the entries of a truth mode with the entries of a detector mode.

    The window of a truth extends from `before` [s] ahead of the entry to the exit of its mode, at
    most for `within` [s]. The first unmatched detection in the window matches. A detection farther
    than `before` from each interval of the truth mode is false.
    """

    name: str
    event: ModeEntryEvent
    truth: ModeEntryEvent
    before: Fraction
    within: Fraction | None
    since: Bound
    until: Bound
    unit: str
    span: Span


@dataclass(frozen=True)
class SignalMeasure:
    """A statistic of a recorded signal in a time window.

    `signal` is the recorded name; an expression is recorded as an additional output. `within` [unit
    of the signal] is the settling band around the final value, `by` the method of a frequency.
    """

    name: str
    kind: SignalKind
    signal: str
    since: Bound
    until: Bound
    within: float
    by: Literal["crossings", "spectrum"]
    unit: str
    span: Span


@dataclass(frozen=True)
class ValueMeasure:
    """An expression of earlier measures: a quantity, or a truth value if `is_truth`."""

    name: str
    formula: Formula
    unit: str
    span: Span
    is_truth: bool = False


Measure = EventMeasure | DelayMeasure | MatchMeasure | SignalMeasure | ValueMeasure

MATCH_PARTS = {
    "truths": "whole", "matched": "whole", "missed": "whole", "detections": "whole",
    "false_events": "whole", "first": "real", "first_missed": "whole", "delays": "list",
}  # fmt: skip
"""The columns `<measure>.<part>` of a match, with their types."""


@dataclass(frozen=True)
class StoreColumn:
    """A column of the store: name, type and SI unit; a list is a list of reals.

    The display unit is `shown`: value in SI = factor * shown value + offset.
    """

    name: str
    type: Literal["real", "whole", "truth", "text", "list"]
    unit: str
    shown: str = ""
    factor: float = 1.0
    offset: float = 0.0

    @property
    def label(self) -> str:
        """The display unit as readers see it: that of `shown`, or of `unit` if that is empty."""
        return display_unit(self.shown or self.unit)


def columns_of(measure: Measure) -> tuple[StoreColumn, ...]:
    """Return the columns that a measure fills: several for a match, else one.

    A match has `<measure>.<part>` for each of MATCH_PARTS. The one has the name and unit of the
    measure; it is truth for a truth value, whole for a count of events, else real.
    """
    if isinstance(measure, MatchMeasure):
        return tuple(
            StoreColumn(f"{measure.name}.{part}", kind, "1" if kind == "whole" else "s")  # type: ignore[arg-type]
            for part, kind in MATCH_PARTS.items()
        )
    if isinstance(measure, ValueMeasure) and measure.is_truth:
        return (StoreColumn(measure.name, "truth", "1"),)
    is_count = isinstance(measure, EventMeasure) and measure.kind == "count"
    return (StoreColumn(measure.name, "whole" if is_count else "real", measure.unit),)
