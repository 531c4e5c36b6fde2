"""Stimulus: the inputs of a scenario as functions of exact time, recordings resolved."""

from __future__ import annotations

import dataclasses
from bisect import bisect_right
from collections.abc import Callable
from fractions import Fraction

from engine.recordings.recording import Channel, Recording, read_recording
from language.loading.stimulus_reader import constant_pieces, linear_pieces
from language.lowering.connection_program import piece_block
from language.model.system import Scenario, Stimulus, StimulusPiece, System
from language.text.diagnostic import Problems, SpecError

EvaluateFormula = Callable[[str, float], float]
"""The value of a piece's formula, by the name of its block, at a time [s]."""


class InputSignal:
    """An input over time: right-continuous; inside a step, the piece of the step's start."""

    def __init__(self, name: str, stimulus: Stimulus, formulas: EvaluateFormula) -> None:
        """Take the input's name, its pieces, and what evaluates formulas."""
        self.name = name
        self.pieces = stimulus.pieces
        self.truth = stimulus.is_bool
        self.varies = stimulus.varies
        self.starts = [piece.start for piece in stimulus.pieces]
        self._formulas = formulas
        self._latest = 0

    def at(self, time: Fraction, since: Fraction | None = None) -> float | bool:
        """Return the value at a time; `since` picks the piece active then: the limit from below."""
        piece_time = time if since is None else since
        number = self._active_piece(piece_time)
        piece = self.pieces[number]
        if piece.formula:
            return self._formulas(piece_block(self.name, number), float(max(time, Fraction(0))))
        if not piece.slope:
            return self.constant_value(piece)
        exact = piece.value + piece.slope * (max(time, Fraction(0)) - piece.start)
        return bool(exact) if self.truth else exact.numerator / exact.denominator

    def constant_value(self, piece: StimulusPiece) -> float | bool:
        """Return the value of a piece that does not vary."""
        exact = piece.value
        return bool(exact) if self.truth else exact.numerator / exact.denominator

    def _active_piece(self, time: Fraction) -> int:
        """Return the place of the piece that is active at a time: most often that of before."""
        starts, latest = self.starts, self._latest
        if not starts[latest] <= time or (latest + 1 < len(starts) and starts[latest + 1] <= time):
            self._latest = max(0, bisect_right(starts, time) - 1)
        return self._latest

    def piece_starts(self) -> list[Fraction]:
        """Return when pieces start, after time 0."""
        return [start for start in self.starts if start > 0]


def resolve_recording(system: System, scenario: Scenario) -> Scenario:
    """Return a scenario in which a recording is replaced by the inputs that it gives.

    Time 0 is the first instant at which every input that the recording gives has had a value.
    Raises SpecError for what is wrong with the file.
    """
    use = scenario.recording
    if use is None:
        return scenario
    columns = {s.column for s in scenario.inputs.values() if s.column}
    columns |= {value for value in scenario.initial.values() if isinstance(value, str)}
    recording = read_recording(use.path, use.mapping, sorted(columns))
    fed = [recording.channels[s.column] for s in scenario.inputs.values() if s.column]
    start = max((channel.times[0] for channel in fed), default=Fraction(0))
    if recording.end <= start:
        problems = Problems()
        label = "the recording ends before every input has a value"
        problems.error("range", use.span, label)
        raise SpecError(problems.reported)
    return dataclasses.replace(
        scenario,
        horizon=recording.end - start if scenario.horizon is None else scenario.horizon,
        initial={
            name: _value_at_start(recording, value, start) if isinstance(value, str) else value
            for name, value in scenario.initial.items()
        },
        inputs={
            name: stimulus_of(recording.channels[s.column], start, s.is_bool) if s.column else s
            for name, s in scenario.inputs.items()
        },
        recording=None,
    )


def stimulus_of(channel: Channel, start: Fraction, truth: bool = False) -> Stimulus:
    """Return a channel as an input from `start` [s] on, held or linear as its column says."""
    values = [Fraction(value) for value in channel.values]
    points = [(time - start, value) for time, value in zip(channel.times, values, strict=True)]
    pieces = linear_pieces(points) if channel.column.hold == "linear" else constant_pieces(points)
    first = max(0, bisect_right([piece.start for piece in pieces], Fraction(0)) - 1)
    return Stimulus(pieces[first:], is_bool=truth)


def _value_at_start(recording: Recording, column: str, start: Fraction) -> Fraction:
    """Return the value of a column at the start: the latest one until then, or the first."""
    channel = recording.channels[column]
    return Fraction(channel.values[max(0, bisect_right(channel.times, start) - 1)])
