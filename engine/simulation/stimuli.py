"""Stimuli: the inputs of a scenario as functions of exact time; recordings become stimuli."""

from __future__ import annotations

import dataclasses
import warnings
from bisect import bisect_right
from collections.abc import Callable
from fractions import Fraction

from engine.recordings.recording import Channel, Recording, read_recording
from language.loading.stimulus_reader import constant_pieces, linear_pieces
from language.model.system import Scenario, Stimulus, StimulusPiece
from language.programs.connection_program import piece_block
from language.text.diagnostic import AssumptionWarning, Problem, SpecError

EvaluateFormula = Callable[[str, float], float]
"""Function that returns the value of a formula piece, by its block and the time [s]."""


class InputSignal:
    """Input as a right-continuous function of time.

    Inside a step the piece at the start of the step is used.
    """

    def __init__(self, name: str, stimulus: Stimulus, formulas: EvaluateFormula) -> None:
        """Take the name of the input, its stimulus, and an evaluator of its formulas."""
        self.name = name
        self.pieces = stimulus.pieces
        self.is_bool = stimulus.is_bool
        self.varies = stimulus.varies
        self.starts = [piece.start for piece in stimulus.pieces]
        self._formulas = formulas
        self._latest = 0

    def at(self, time: Fraction, since: Fraction | None = None) -> float | bool:
        """Return the value at a time [s]; before the first piece it is that of the first piece.

        `since` selects the piece that is active at that earlier time, which gives the limit from
        below at the end of a step. Negative times count as 0 in formulas and slopes. A bool input
        gives a bool.
        """
        piece_time = time if since is None else since
        number = self._active_piece(piece_time)
        piece = self.pieces[number]
        if piece.formula:
            return self._formulas(piece_block(self.name, number), float(max(time, Fraction(0))))
        if not piece.slope:
            return self.constant_value(piece)
        exact = piece.value + piece.slope * (max(time, Fraction(0)) - piece.start)
        return bool(exact) if self.is_bool else exact.numerator / exact.denominator

    def constant_value(self, piece: StimulusPiece) -> float | bool:
        """Return the value of a piece, without its slope and formula; a bool for a bool input."""
        exact = piece.value
        return bool(exact) if self.is_bool else exact.numerator / exact.denominator

    def _active_piece(self, time: Fraction) -> int:
        """Return the index of the piece at a time [s]; the previous one is tried first."""
        starts, latest = self.starts, self._latest
        if not starts[latest] <= time or (latest + 1 < len(starts) and starts[latest + 1] <= time):
            self._latest = max(0, bisect_right(starts, time) - 1)
        return self._latest


def resolve_recording(scenario: Scenario) -> Scenario:
    """Return a scenario in which the inputs of a recording are stimuli.

    Without a recording the scenario itself is returned. Time 0 is the first time at which every
    input from the recording has a value. Initial values that name a column have its latest value at
    that time, else its first one. A missing horizon is the end of the recording. Raises SpecError
    for mistakes in the file, and if it ends before time 0. Warns (AssumptionWarning) of each
    assumption about the file.
    """
    use = scenario.recording
    if use is None:
        return scenario
    columns = {s.column for s in scenario.inputs.values() if s.column}
    columns |= {value for value in scenario.initial.values() if isinstance(value, str)}
    recording = read_recording(use.path, use.mapping, sorted(columns))
    for item in recording.assumptions:
        warnings.warn(item.text, AssumptionWarning, stacklevel=2)
    fed = [recording.channels[s.column] for s in scenario.inputs.values() if s.column]
    start = max((channel.times[0] for channel in fed), default=Fraction(0))
    if recording.end <= start:
        label = "the recording ends before every input has a value"
        raise SpecError([Problem("range", use.span, label)])
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


def stimulus_of(channel: Channel, start: Fraction, is_bool: bool = False) -> Stimulus:
    """Return a channel as a stimulus whose time 0 is `start` [s], held or linear as the map says.

    Pieces that end before time 0 are left out. The first value holds before the first sample, the
    last one after the last.
    """
    values = [Fraction(value) for value in channel.values]
    points = [(time - start, value) for time, value in zip(channel.times, values, strict=True)]
    pieces = linear_pieces(points) if channel.column.hold == "linear" else constant_pieces(points)
    first = max(0, bisect_right([piece.start for piece in pieces], Fraction(0)) - 1)
    return Stimulus(pieces[first:], is_bool=is_bool)


def _value_at_start(recording: Recording, column: str, start: Fraction) -> Fraction:
    """Return the latest value of a column up to `start` [s]; its first value if there is none."""
    channel = recording.channels[column]
    return Fraction(channel.values[max(0, bisect_right(channel.times, start) - 1)])
