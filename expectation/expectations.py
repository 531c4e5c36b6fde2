"""Expectations: the model of a test - conditions, events, modes and time constraints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

from language.loading.mode_entry_event import ModeEntryEvent
from language.model.declaration import Formula
from language.model.system import Scenario, System
from language.text.diagnostic import Source, Span
from language.typecheck.types import ExprType

RegionRef = tuple[str, str]
"""An instance and the name of one of its regions."""


@dataclass(frozen=True)
class ModePredicate:
    """The predicate that a region is in one of the given leaf modes."""

    region_ref: RegionRef
    modes: frozenset[str]


@dataclass(frozen=True)
class RunningStatistic:
    """A statistic of the run up to the present: `count`, `first` (time [s]) or `rms`.

    `count` counts rising edges of a condition or entries of a region. `first` is the time at which
    a condition first holds. `since` [s] is the start of a root mean square.
    """

    function: Literal["count", "first", "rms"]
    operand: Condition | RegionRef
    since: Fraction = Fraction(0)


@dataclass(frozen=True)
class FaultFlag:
    """One bit of a signal that is a fault word."""

    signal: str
    bit: int


@dataclass(frozen=True)
class Condition:
    """An expression over a run.

    Its names are signals, enumeration literals, or keys of `stays` (mode predicates), `flags` and
    `running`. `kind` is the type of its value.
    """

    formula: Formula
    text: str
    signals: Mapping[str, ExprType] = field(default_factory=dict)
    mode_predicates: Mapping[str, ModePredicate] = field(default_factory=dict)
    flags: Mapping[str, FaultFlag] = field(default_factory=dict)
    running: Mapping[str, RunningStatistic] = field(default_factory=dict)
    literals: Mapping[str, int] = field(default_factory=dict)
    kind: ExprType = "truth"

    @property
    def all_signals(self) -> tuple[str, ...]:
        """The signals to which the expression and its running statistics refer, each once.

        Fault words are included. A condition without signals is known between rows, too.
        """
        found = dict.fromkeys([*self.signals, *(flag.signal for flag in self.flags.values())])
        for running in self.running.values():
            if isinstance(running.operand, Condition):
                found.update(dict.fromkeys(running.operand.all_signals))
        return tuple(found)


Trigger = Condition | ModeEntryEvent
"""The start of an interval: a condition that becomes true, or an event."""
Subject = Condition | ModeEntryEvent | tuple[str, ...]
"""The subject of an expectation: a condition, an event, or the modes of a region in order."""


@dataclass(frozen=True)
class TimeConstraint:
    """The time constraint of an expectation; times in s, None if not stated."""

    at: Fraction | None = None
    within: Fraction | None = None
    before: Fraction | None = None
    since: Fraction | None = None
    until: Fraction | None = None
    after: Trigger | None = None
    after_text: str = ""


@dataclass(frozen=True)
class Expectation:
    """One entry of a test.

    `region_ref` is the region of expected modes; `count` is the expected number of events.
    """

    name: str
    kind: Literal["that", "always", "never", "event", "modes"]
    subject: Subject
    when: TimeConstraint
    text: str
    span: Span
    count: int | None = None
    region_ref: RegionRef | None = None
    requirements: tuple[str, ...] = ()

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """The conditions among subject and trigger (`when.after`), in this order; possibly none."""
        found = (self.subject, self.when.after)
        return tuple(part for part in found if isinstance(part, Condition))


@dataclass(frozen=True)
class Test:
    """A test: a system with a scenario that records the signals of the expectations."""

    __test__ = False  # for pytest

    name: str
    system: System
    scenario: Scenario
    expectations: tuple[Expectation, ...]
    span: Span
    source: Source
    about: str = ""
    requirements: tuple[str, ...] = ()
