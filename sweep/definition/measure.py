"""Measure: what is kept of one variant - events, delays between them, numbers of signals."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

from language.expressions.units import display_unit
from language.loading.event_names import ModeEntryEvent
from language.model.declaration import Formula
from language.text.diagnostic import Span

SignalKind = Literal["peak", "max", "min", "mean", "rms", "final", "settling", "frequency"]
Bound = Fraction | str | None
"""An end of a window: a time [s], the name of an earlier measure, or none."""


@dataclass(frozen=True)
class EventMeasure:
    """The time [s] of the n-th event in a window, or how many there are."""

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
    """From the n-th event `after` [s] to the first `event` that is not earlier than `before`.

    Negative: it came before. None where there is no such event, or not `within` [s].
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
    """Every entry of a mode by a truth against the entries by a detector.

    The window of a truth is from `before` [s] ahead of it until its mode is left, or for `within`
    [s] at most. The first detection in a window matches. One that is farther than `before` from all
    stays in that mode is false.
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
    """A number of a recorded signal over a window.

    `signal` is the recorded name; an expression is recorded under a name of its own. `within` [unit
    of the signal] is the band of `settling` around the final value, `by` how a frequency is found.
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
    """An expression of earlier measures: a quantity, or whether something is the case."""

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
"""The columns of a match, `<measure>.<part>`, and what they hold."""


@dataclass(frozen=True)
class StoreColumn:
    """A column of the store; a list is one of reals, `unit` is in SI.

    It is shown in the unit `shown`: value in SI = factor * shown value + offset.
    """

    name: str
    type: Literal["real", "whole", "truth", "text", "list"]
    unit: str
    shown: str = ""
    factor: float = 1.0
    offset: float = 0.0

    @property
    def label(self) -> str:
        """The unit in which it is shown, for readers."""
        return display_unit(self.shown or self.unit)


def columns_of(measure: Measure) -> tuple[StoreColumn, ...]:
    """Return the columns that a measure fills."""
    if isinstance(measure, MatchMeasure):
        return tuple(
            StoreColumn(f"{measure.name}.{part}", kind, "1" if kind == "whole" else "s")  # type: ignore[arg-type]
            for part, kind in MATCH_PARTS.items()
        )
    if isinstance(measure, ValueMeasure) and measure.is_truth:
        return (StoreColumn(measure.name, "truth", "1"),)
    is_count = isinstance(measure, EventMeasure) and measure.kind == "count"
    return (StoreColumn(measure.name, "whole" if is_count else "real", measure.unit),)
