"""System: the data classes of systems, scenarios and recording maps."""

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
from language.typecheck.types import ExprType, TypeName


@dataclass(frozen=True)
class StimulusPiece:
    """An input from `start` [s] on: value + slope * (t - start), or a formula of `time`; SI."""

    start: Fraction
    value: Fraction
    slope: Fraction = Fraction(0)
    formula: Formula | None = None

    @property
    def varies(self) -> bool:
        """Whether the value changes within the piece: the slope is not 0, or there is a formula."""
        return self.slope != 0 or self.formula is not None


@dataclass(frozen=True)
class Stimulus:
    """An input over time as right-continuous pieces, the first at time 0; each start is an event.

    If `column` is set, that column of the scenario's recording replaces the pieces.
    """

    pieces: tuple[StimulusPiece, ...]
    column: str | None = None
    is_bool: bool = False

    @property
    def steps(self) -> tuple[tuple[Fraction, Fraction], ...]:
        """The pairs (start [s], value there) of the pieces.

        Slopes, formulas and a `column` are not considered.
        """
        return tuple((piece.start, piece.value) for piece in self.pieces)

    @property
    def varies(self) -> bool:
        """Whether some piece has a slope or a formula; a `column` is not considered."""
        return any(piece.varies for piece in self.pieces)


@dataclass(frozen=True)
class Sensor:
    """A measured output with its stages in the order of the fields, in SI (rule 19c).

    A stage of value 0 is absent. A sensor with the period None gives its value whenever it is read.
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
    """A signal in a connection with the value that `source` had `delay` [s] ago."""

    name: str
    source: str
    delay: Fraction


@dataclass(frozen=True)
class RecordingSource:
    """The recording from which a scenario takes inputs, with the map of its columns."""

    path: Path
    mapping: RecordingMap
    span: Span


@dataclass(frozen=True)
class Instance:
    """A named use of an automaton in a system; `offset` [s] is the time of its first tick."""

    name: str
    automaton: Automaton
    offset: Fraction
    key: str
    span: Span


@dataclass(frozen=True)
class SystemInput:
    """An input of a system; `values` are the literals of an `enum`."""

    name: str
    unit: Unit
    default: Fraction | None
    span: Span
    type: TypeName = "real"
    values: tuple[str, ...] = ()

    @property
    def is_bool(self) -> bool:
        """Whether the type of the input is `bool`."""
        return self.type == "bool"


@dataclass(frozen=True)
class Connection:
    """The source of an input of an instance: a signal by name, a constant (SI) or an expression.

    `target` is the instance and its input. Signals are inputs of the system, sensors, delayed
    signals, and outputs written `instance.output`.
    """

    target: tuple[str, str]
    source: str | Fraction | Formula
    span: Span

    @property
    def reads(self) -> tuple[str, ...]:
        """The names of the signals that the connection reads, each once.

        A signal gives its name, a constant nothing, an expression its names in order of first
        occurrence.
        """
        if isinstance(self.source, Formula):
            return tuple(dict.fromkeys(name.path for name in names(self.source.tree)))
        return (self.source,) if isinstance(self.source, str) else ()


@dataclass(frozen=True)
class System:
    """Instances of automata with sensors and connections.

    `order` is the order in which instances and sensors run at one instant. `dimensions` are those
    of the outputs that are expressions with a real value. `sole_instance` is the name of the only
    instance if the system was built for an automaton on its own.
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
        """The names of the signals that can be recorded, each once.

        These are the inputs, the outputs of instances as `instance.output`, the sensors and the
        outputs of the system, in this order. Delayed signals are left out.
        """
        parts = [
            f"{i.name}.{name}" for i in self.instances.values() for name in i.automaton.outputs
        ]
        return tuple(dict.fromkeys([*self.inputs, *parts, *self.sensors, *self.outputs]))


@dataclass(frozen=True)
class ScheduledCalibration:
    """A calibration that applies from `time` [s] on: values [SI] by instance and parameter."""

    time: Fraction
    values: Mapping[tuple[str, str], Fraction]


@dataclass(frozen=True)
class Scenario:
    """The inputs, initial values and horizon of a simulation, and the signals that it records.

    `horizon` [s] is None if the recording determines it. An initial value that is a string is the
    first value of that column of the recording. All signals are recorded if `signals` is empty.
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
    """The use of one or several columns of a recording as a signal.

    Of several `columns` the mean is used. The signal is the input `to`, or it is compared with the
    output `compare`. `delay` is in s. `time` names a time column of its own. Without `hold` a value
    is kept until the next one; a diagnosis may then choose (`diagnosis.selection.intersample`).
    `unit` holds although the file states `file_unit`. `signal_type` is the type of the signal if it
    is a truth value, a whole number or an enumeration, and None for a real or unknown signal.
    """

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
    hold: Literal["previous", "linear"] | None = None
    file_unit: str = ""
    signal_type: ExprType | None = None


@dataclass(frozen=True)
class TextFormat:
    """The format of a text recording as a map states it; what is empty or 0 is detected.

    `head` is the number of the line with the names of the columns, `units` that of their units.
    """

    separator: str = ""
    decimal: str = ""
    encoding: str = ""
    head: int = 0
    units: int = 0


Window = tuple[Fraction, Fraction]
"""Start and end [s] of an interval in the time of a recording, both included."""

ALL_FILES = ""
"""The key of windows that apply to every file."""


@dataclass(frozen=True)
class CanDatabase:
    """The name of a DBC file, and of the bus that it describes; empty for each bus of a log."""

    file: ScalarNode
    bus: str = ""


@dataclass(frozen=True)
class RecordingMap:
    """The assignment of the columns of a recording to signals.

    `windows` are the time intervals to use, by file name or `ALL_FILES`; without any, the whole
    recording is used. `time` is empty if the files carry time stamps themselves. `databases` are
    DBC files. `date_order` is the order of dates in the time columns (`DMY`, `MDY`);
    empty if it follows from the dates.
    """

    name: str
    time: str
    time_unit: Unit
    columns: Mapping[str, ColumnMapping]
    constants: Mapping[str, tuple[Fraction, Dimension]]
    span: Span
    windows: Mapping[str, tuple[Window, ...]] = field(default_factory=dict)
    databases: tuple[CanDatabase, ...] = ()
    text_format: TextFormat = TextFormat()
    date_order: str = ""

    def windows_of(self, file: str) -> tuple[Window, ...]:
        """Return the windows of a file, by the name used in `windows`, else those for ALL_FILES.

        An empty result means that the whole file is used.
        """
        return self.windows.get(file, self.windows.get(ALL_FILES, ()))
