"""Signal: what runs over the wires of a system - inputs over time, sensors, delays."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

from language.problem import Span
from language.units import Dimension

if TYPE_CHECKING:
    from language.declaration import Formula
    from language.experiment import RecordingMap


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
