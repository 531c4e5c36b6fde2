"""Expected: what a test expects of a run - conditions, events and modes, and when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

from language.loading.event_names import ModeEntryEvent
from language.model.declaration import Formula
from language.model.system import Scenario, System
from language.text.diagnostic import Source, Span
from language.typecheck.types import ExprType

RegionRef = tuple[str, str]
"""An instance and one of its regions."""


@dataclass(frozen=True)
class ModePredicate:
    """Whether one of some modes of a region is active."""

    region_ref: RegionRef
    modes: frozenset[str]


@dataclass(frozen=True)
class RunningStatistic:
    """A number of the run so far: `count` (of changes), `first` (time [s]), `rms`.

    What it reads is a condition or a quantity, or for `count` also the mode of a region.
    `since` [s] is where the root mean square begins.
    """

    function: Literal["count", "first", "rms"]
    operand: Condition | RegionRef
    since: Fraction = Fraction(0)


@dataclass(frozen=True)
class FaultFlag:
    """One bit of a fault word, a signal."""

    signal: str
    bit: int


@dataclass(frozen=True)
class Condition:
    """An expression over a run; its names are signals, or keys of `stays`, `flags`, `running`."""

    formula: Formula
    text: str
    signals: Mapping[str, ExprType] = field(default_factory=dict)
    stays: Mapping[str, ModePredicate] = field(default_factory=dict)
    flags: Mapping[str, FaultFlag] = field(default_factory=dict)
    running: Mapping[str, RunningStatistic] = field(default_factory=dict)
    literals: Mapping[str, int] = field(default_factory=dict)
    kind: ExprType = "truth"

    @property
    def all_signals(self) -> tuple[str, ...]:
        """The signals that are read, by what runs too; none: it is known between rows."""
        found = dict.fromkeys([*self.signals, *(flag.signal for flag in self.flags.values())])
        for running in self.running.values():
            if isinstance(running.operand, Condition):
                found.update(dict.fromkeys(running.operand.all_signals))
        return tuple(found)


Trigger = Condition | ModeEntryEvent
Subject = Condition | ModeEntryEvent | tuple[str, ...]
"""What is expected: that something is the case, an event, or the modes of a region in order."""


@dataclass(frozen=True)
class TimeConstraint:
    """When something is expected; all times in s, None where nothing is said."""

    at: Fraction | None = None
    within: Fraction | None = None
    before: Fraction | None = None
    since: Fraction | None = None
    until: Fraction | None = None
    after: Trigger | None = None
    after_text: str = ""


@dataclass(frozen=True)
class Expectation:
    """One line of a test. `place` is the region whose modes are expected, `count` of events."""

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
        """The conditions that have to be known to judge it."""
        found = (self.subject, self.when.after)
        return tuple(part for part in found if isinstance(part, Condition))


@dataclass(frozen=True)
class Test:
    """A test: a system through a scenario, recorded as the expectations need it."""

    __test__ = False  # for pytest

    name: str
    system: System
    scenario: Scenario
    expectations: tuple[Expectation, ...]
    span: Span
    source: Source
    about: str = ""
    requirements: tuple[str, ...] = ()
