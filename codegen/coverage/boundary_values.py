"""Boundary value tests: inputs on both sides of the value at which the next mode changes.

The module implements boundary value analysis (ISO 26262-6:2018, table 8) around given input
sequences. At each tick in which a mode changes or a wait begins, it bisects each real input of that
tick, and of the tick before, between its value and an end of its range. The bisection stops at two
adjacent floating-point numbers that lead to different modes.
"""

from __future__ import annotations

import math
import struct
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from codegen.coverage.libfuzzer import DEFAULT_INPUT_RANGE, Range
from codegen.harness.harness import tick_inputs
from codegen.simulator.compiled_stepper import CompiledStepper
from language.ir.number_type import ROUNDING_FUNCTIONS
from language.ir.program import Program, unqualified_name
from language.programs.model_run import RUN_MODE

NEIGHBOUR_COUNT = 8
"""Number of test values on each side of a boundary."""
MAX_PER_CHANGE = 3
"""Maximum number of boundaries of one input for the same change of a mode or wait."""
MAX_TOTAL_TICKS = 200_000
"""Maximum number of ticks of all sequences that are searched; they take some seconds."""
MAX_BISECTIONS = 200
"""Maximum number of halvings of one interval."""
PYTHON_TYPES = {"real": float, "truth": bool, "whole": int}
"""The Python type of a value by the type of a variable."""
Modes = tuple[Any, ...]
Values = tuple[float, ...]
Change = tuple[int, Any, Any]
"""The index of the mode variable that changes, its old value and its new value."""


@dataclass(frozen=True)
class Boundary:
    """Two adjacent values of a real input that lead to different modes.

    `input_index` is the position of the input in an input record. The input takes the value `near`
    or `far` at `tick`; the modes differ at the end of tick `last`.
    """

    tick: int
    last: int
    input_index: int
    near: float
    far: float


def generate_boundary_sequences(
    program: Program, sequences: Sequence[Sequence[bytes]], ranges: Mapping[str, Range]
) -> Iterator[list[bytes]]:
    """Yield input sequences that end at, or close to, a boundary of one of the given sequences.

    A boundary is two adjacent values of a real input between which a mode, or whether a wait has
    begun, changes. Each boundary gives 2 * NEIGHBOUR_COUNT sequences: the given one up to the last
    tick of the boundary, with that input set to values on both sides. The records are those of a
    `TickLog`. A sequence is searched up to its first record that changes the calibration page; the
    search ends after MAX_TOTAL_TICKS ticks of all sequences. `ranges` gives ranges of inputs by
    name; an input without one has DEFAULT_INPUT_RANGE. Raises MissingToolError, BuildError.
    """
    record = struct.Struct(f"<{len(tick_inputs(program)) + 1}d")
    search = _BoundarySearch(program, ranges)
    ticks_left = MAX_TOTAL_TICKS
    for sequence in sequences:
        changed = (k for k, one in enumerate(sequence) if len(one) != record.size)
        known = list(sequence[: next(changed, ticks_left)][:ticks_left])
        ticks_left -= len(known)
        for boundary in search.find_boundaries([record.unpack(one) for one in known]):
            moved = list(record.unpack(known[boundary.tick]))
            for value in _neighbouring_values(boundary, program):
                moved[boundary.input_index] = value
                rest = known[boundary.tick + 1 : boundary.last + 1]
                yield [*known[: boundary.tick], record.pack(*moved), *rest]


def _neighbouring_values(boundary: Boundary, program: Program) -> Iterator[float]:
    """Yield the NEIGHBOUR_COUNT test values on each side, in steps of `far - near`."""
    step, cast = boundary.far - boundary.near, ROUNDING_FUNCTIONS[program.number_type]
    yield from (
        cast(boundary.near + k * step) for k in range(1 - NEIGHBOUR_COUNT, NEIGHBOUR_COUNT + 1)
    )


class _BoundarySearch:
    """A search for boundaries with the compiled C of a Program, restarted from snapshots."""

    def __init__(self, program: Program, ranges: Mapping[str, Range]) -> None:
        """Compile the Program. Raises MissingToolError, BuildError."""
        self._stepper, self._ranges = CompiledStepper(program), ranges
        self._initial = self._stepper.snapshot()
        self._inputs, self._cast = tick_inputs(program), ROUNDING_FUNCTIONS[program.number_type]
        run = (RUN_MODE,) if program.run_modes else ()
        self._modes = (*program.mode_variables().values(), *run)
        self._waits = [v.name for v in program.variables if v.name.startswith("timer.")]
        self._counts: Counter[tuple[Change, int, int]] = Counter()

    def find_boundaries(self, inputs: Sequence[Values]) -> Iterator[Boundary]:
        """Yield the boundaries of one sequence of input values, in the order of its ticks."""
        self._stepper.restore(self._initial)
        past = now = self._stepper.snapshot()
        before = self._current_modes()
        for tick, values in enumerate(inputs):
            after = self._run_ticks(now, [values])
            past, now, begun = now, self._stepper.snapshot(), past
            changes = {
                (k, *c) for k, c in enumerate(zip(before, after, strict=True)) if c[0] != c[1]
            }
            if changes:
                yield from self._search_tick(inputs, tick, tick, past, changes)
                if tick:
                    yield from self._search_tick(inputs, tick - 1, tick, begun, changes)
            before = after

    def _search_tick(
        self,
        inputs: Sequence[Values],
        tick: int,
        last: int,
        snapshot: bytes,
        changes: set[Change],
    ) -> Iterator[Boundary]:
        """Yield at most one boundary for each real input of `tick`.

        `snapshot` is the state before `tick`; the modes are compared at the end of tick `last`. An
        input is skipped if it has MAX_PER_CHANGE boundaries for each of the changes already.
        """
        for place, variable in enumerate(self._inputs):
            kinds = [(change, place, last - tick) for change in changes]
            if variable.type != "real" or all(
                self._counts[kind] >= MAX_PER_CHANGE for kind in kinds
            ):
                continue
            ends = self._ranges.get(unqualified_name(variable.name), DEFAULT_INPUT_RANGE)
            found = self._bisect(snapshot, inputs[tick : last + 1], place, ends)
            if found:
                self._counts.update(kinds)
                yield Boundary(tick, last, place, *found)

    def _bisect(
        self, snapshot: bytes, inputs: Sequence[Values], place: int, ends: Range
    ) -> tuple[float, float] | None:
        """Return two adjacent values (near, far) of an input that lead to different modes.

        The search runs from the value in the first of `inputs` to the first end of the range that
        leads to other modes. Returns None if neither end does, or if the value is not finite.
        """
        (first, *rest), cast = inputs, self._cast

        def modes(value: float) -> Modes:
            return self._run_ticks(snapshot, [(*first[:place], value, *first[place + 1 :]), *rest])

        near = first[place]
        if not math.isfinite(near):
            return None
        here = modes(near)
        others = [end for end in map(cast, ends) if modes(end) != here]
        if not others:
            return None
        far = others[0]
        for _ in range(MAX_BISECTIONS):
            middle = cast(near + 0.5 * (far - near))
            if middle in (near, far):
                return near, far
            near, far = (middle, far) if modes(middle) == here else (near, middle)
        return None

    def _run_ticks(self, snapshot: bytes, inputs: Sequence[Values]) -> Modes:
        """Restore a snapshot, execute one tick for each input record, and return the modes."""
        self._stepper.restore(snapshot)
        for values in inputs:
            for variable, value in zip(self._inputs, values, strict=False):
                self._stepper.set(variable.name, PYTHON_TYPES[variable.type](value))
            self._stepper.run("step")
        return self._current_modes()

    def _current_modes(self) -> Modes:
        """Return the values of the mode variables, then for each wait whether it has begun."""
        get = self._stepper.get
        return (*(get(name) for name in self._modes), *(get(name) > 0 for name in self._waits))
