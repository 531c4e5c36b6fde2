"""Row recorder: collects the recorded signals of a run at the times of its rows."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine.results.sampled_run import SignalArray as Column
from engine.results.trajectory import column_array
from language.expressions.units import display_unit
from language.ir.program import Program, ValueType
from language.model.declaration import Formula
from language.model.system import Scenario, System
from language.programs.connection_program import output_block

RowValues = tuple[Any, ...]
"""Values of one row, in the order of the recorded columns."""


@dataclass(frozen=True)
class RecordedColumn:
    """Recorded signal: name, type, unit, and its source.

    An expression is evaluated by the output block `block`; otherwise `source` is the signal to
    read. `is_piecewise_constant` is true if it changes at single instants only: for the outputs of
    sampled automata, sensors with a period, and expressions of such signals.
    """

    name: str
    type: ValueType
    unit: str
    block: str | None
    source: str
    is_piecewise_constant: bool = False


def recorded_columns(
    system: System, scenario: Scenario, programs: Mapping[str, Program]
) -> tuple[RecordedColumn, ...]:
    """Return the recorded columns of a run, in the order of the names.

    The names are those of `scenario.signals`, which may be inputs, signals of instances, sensors
    and outputs of the system. Without them they are the outputs of all instances, all sensors and
    those outputs of the system that are expressions. Raises KeyError for an unknown name.
    """
    known: dict[str, RecordedColumn] = {}
    for name, thing in system.inputs.items():
        kind: ValueType = "truth" if thing.is_bool else "real"
        known[name] = RecordedColumn(name, kind, str(thing.unit.dimension), None, name)
    default_names: list[str] = []
    for owner, program in programs.items():
        for wire in program.outputs:
            name = f"{owner}.{wire.name}"
            unit, is_sampled = display_unit(wire.unit), program.period is not None
            known[name] = RecordedColumn(name, wire.type, unit, None, name, is_sampled)
            default_names.append(name)
    for name, sensor in system.sensors.items():
        is_sampled = sensor.period is not None
        known[name] = RecordedColumn(name, "real", str(sensor.dimension), None, name, is_sampled)
        default_names.append(name)
    for name, output in system.outputs.items():
        if isinstance(output, Formula):
            dimension = system.dimensions.get(name)
            kind = "real" if dimension else "truth"
            block = output_block(name)
            is_constant = all(
                read in known and known[read].is_piecewise_constant for read in output.reads
            )
            known[name] = RecordedColumn(
                name, kind, str(dimension or "1"), block, name, is_constant
            )
            default_names.append(name)
        else:
            part = known[output]
            known[name] = dataclasses.replace(part, name=name, unit=display_unit(part.unit))
    return tuple(known[name] for name in scenario.signals or default_names)


class RowRecorder:
    """Recorded rows of a run, in the order of time."""

    def __init__(self, columns: tuple[RecordedColumn, ...]) -> None:
        """Start without rows."""
        self.columns = columns
        self.times: list[Fraction] = []
        self._rows: list[tuple[Any, ...]] = []

    def add(
        self,
        time: Fraction,
        read: Callable[[str], Any],
        formula: Callable[[str, Callable[[str], Any]], Any],
    ) -> None:
        """Append the row of a time [s].

        `read` returns the value of a signal; `formula` evaluates an output block with `read`.
        """
        self.times.append(time)
        row = [formula(c.block, read) if c.block else read(c.source) for c in self.columns]
        self._rows.append(tuple(row))

    def make_row_picker(self, names: Sequence[str]) -> Callable[[RowValues], RowValues] | None:
        """Return a function that selects the row from a tuple of the values of `names`.

        The result is None if a column is an expression or its signal is not among `names`.
        """
        if any(column.block or column.source not in names for column in self.columns):
            return None
        places = [names.index(column.source) for column in self.columns]
        if len(places) > 1:
            return itemgetter(*places)  # faster
        return lambda values: tuple(values[place] for place in places)

    def extend(self, times: Sequence[Fraction], rows: Iterable[RowValues]) -> None:
        """Append complete rows, in the order of the columns, with their times [s]."""
        self.times += times
        self._rows += rows

    def signals(self) -> dict[str, Column]:
        """Return the values of each column (n_rows,) by name, in the type of the column."""
        columns = list(zip(*self._rows, strict=True)) if self._rows else [()] * len(self.columns)
        return {
            column.name: column_array(column.type, values)
            for column, values in zip(self.columns, columns, strict=True)
        }

    def units(self) -> dict[str, str]:
        """Return the unit of each column by name."""
        return {column.name: column.unit for column in self.columns}

    def piecewise_constant(self) -> frozenset[str]:
        """Return the names of the columns that change at single instants only."""
        return frozenset(column.name for column in self.columns if column.is_piecewise_constant)

    def seconds(self) -> NDArray[np.float64]:
        """Return the times of the rows [s] (n_rows,), rounded."""
        return np.array([float(time) for time in self.times])
