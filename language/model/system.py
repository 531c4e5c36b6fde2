"""Experiment: a checked system with its connections, a scenario for it, and maps of recordings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Literal

from language.expressions.syntax_tree import names
from language.expressions.units import Dimension, Unit
from language.model.automaton import Automaton
from language.model.declaration import Formula
from language.text.diagnostic import Span
from language.text.document import ScalarNode
from language.typecheck.types import TypeName


@dataclass(frozen=True)
class StimulusPiece:
    """An input from `start` [s] on: value + slope * (t - start), or a formula of `time` (SI)."""

    start: Fraction
    value: Fraction
    slope: Fraction = Fraction(0)
    formula: Formula | None = None

    @property
    def varies(self) -> bool:
        """Tell whether the input changes between events."""
        return self.slope != 0 or self.formula is not None


@dataclass(frozen=True)
class Stimulus:
    """An input over time: right-continuous pieces, the first at time 0. Their starts are events.

    `column` names the column of the scenario's recording that gives the pieces instead.
    """

    pieces: tuple[StimulusPiece, ...]
    column: str | None = None
    is_bool: bool = False

    @property
    def steps(self) -> tuple[tuple[Fraction, Fraction], ...]:
        """When each piece starts, and its value there."""
        return tuple((piece.start, piece.value) for piece in self.pieces)

    @property
    def varies(self) -> bool:
        """Tell whether the input changes between events."""
        return any(piece.varies for piece in self.pieces)


@dataclass(frozen=True)
class Sensor:
    """A measured output; the stages apply in the order of the fields (0: stage absent), SI.

    `period` is None where the sensor gives its value whenever it is read.
    """

    name: str
    source: str
    dimension: Dimension
    lag: Fraction
    delay: Fraction
    noise: Fraction
    quantum: Fraction
    period: Fraction | None
    offset: Fraction
    span: Span


@dataclass(frozen=True)
class DelayedSignal:
    """A delayed signal in a connection: `source` as it was `delay` [s] ago."""

    name: str
    source: str
    delay: Fraction


@dataclass(frozen=True)
class RecordingSource:
    """The recording that a scenario takes inputs from, and how its columns become signals."""

    path: Path
    mapping: RecordingMap
    span: Span


@dataclass(frozen=True)
class Instance:
    """A named use of an automaton in a system."""

    name: str
    automaton: Automaton
    offset: Fraction
    key: str
    span: Span


@dataclass(frozen=True)
class SystemInput:
    """An input of a system."""

    name: str
    unit: Unit
    default: Fraction | None
    span: Span
    type: TypeName = "real"
    values: tuple[str, ...] = ()

    @property
    def is_bool(self) -> bool:
        """Tell whether it is true or false."""
        return self.type == "bool"


@dataclass(frozen=True)
class Connection:
    """What an input of an instance reads: a signal by name, a constant (SI) or an expression.

    Signals are inputs of the system, its sensors and lines, and outputs `instance.output`.
    """

    target: tuple[str, str]
    source: str | Fraction | Formula
    span: Span

    @property
    def reads(self) -> tuple[str, ...]:
        """The signals that are read."""
        if isinstance(self.source, Formula):
            return tuple(dict.fromkeys(name.path for name in names(self.source.tree)))
        return (self.source,) if isinstance(self.source, str) else ()


@dataclass(frozen=True)
class System:
    """Instances, how they are connected; `order`: how they and sensors run.

    `dimensions` are those of the outputs that are expressions with a real value.

    `alone` is the name of the one instance where the system was made around an automaton.
    """

    name: str
    inputs: Mapping[str, SystemInput]
    instances: Mapping[str, Instance]
    connections: Mapping[tuple[str, str], Connection]
    outputs: Mapping[str, str | Formula]
    order: tuple[str, ...]
    span: Span
    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    delayed_signals: Mapping[str, DelayedSignal] = field(default_factory=dict)
    dimensions: Mapping[str, Dimension] = field(default_factory=dict)
    sole_instance: str | None = None

    @property
    def signals(self) -> tuple[str, ...]:
        """What can be recorded: inputs, outputs of instances, sensors, outputs of the system."""
        parts = [
            f"{i.name}.{name}" for i in self.instances.values() for name in i.automaton.outputs
        ]
        return tuple(dict.fromkeys([*self.inputs, *parts, *self.sensors, *self.outputs]))


@dataclass(frozen=True)
class ScheduledCalibration:
    """A calibration from a time on: values [SI] of tunable parameters by instance and name."""

    time: Fraction
    values: Mapping[tuple[str, str], Fraction]


@dataclass(frozen=True)
class Scenario:
    """Inputs, initial values, horizon of a system and what is recorded of it.

    `horizon` is None where it is that of the recording; an initial value given as a text is the
    first value of that column; `signals` is empty where everything is recorded.
    """

    name: str
    of: str
    horizon: Fraction | None
    initial: Mapping[str, Fraction | str]
    inputs: Mapping[str, Stimulus]
    every: Fraction
    span: Span
    seed: int = 0
    signals: tuple[str, ...] = ()
    recording: RecordingSource | None = None
    calibrations: tuple[ScheduledCalibration, ...] = ()


@dataclass(frozen=True)
class ColumnMapping:
    """One signal of a recording: its columns (mean of them), target, unit and form."""

    name: str
    columns: tuple[str, ...]
    to: str | None
    compare: str | None
    unit: Unit
    scale: tuple[Fraction, Dimension]
    sign: int
    delay: Fraction
    blank: Literal["refuse", "skip"]
    time: str | None
    span: Span
    hold: Literal["previous", "linear"] = "previous"


Window = tuple[Fraction, Fraction]
"""From and to, both included [s], in the time of the recording."""

ALL_FILES = ""
"""The key of windows that are not those of one file."""


@dataclass(frozen=True)
class RecordingMap:
    """How the columns of a recording become signals.

    `windows` are the times to use, by file name or `EVERY_FILE`; where there is none, all is used.
    `time` is empty where files carry time stamps themselves; `databases` are DBC files.
    """

    name: str
    time: str
    time_unit: Unit
    columns: Mapping[str, ColumnMapping]
    constants: Mapping[str, tuple[Fraction, Dimension]]
    span: Span
    windows: Mapping[str, tuple[Window, ...]] = field(default_factory=dict)
    databases: tuple[ScalarNode, ...] = ()

    def windows_of(self, file: str) -> tuple[Window, ...]:
        """Return the windows of a file; none where all of it is used."""
        return self.windows.get(file, self.windows.get(ALL_FILES, ()))
