"""Border: an input of a tick, moved to where another mode follows: the numbers on both sides.

Boundary values (ISO 26262-6:2018, table 8) of what a sequence does: where a mode changes or a wait
begins, each real input of that tick and of the one before is bisected between what it was and an
end of its range, until two neighbours among the numbers are followed by different modes. Where
rounding decides, it does there.
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
"""Numbers on each side of a border."""
MAX_PER_CHANGE = 3
"""Borders of the same input for the same change of a mode or a wait."""
MAX_TOTAL_TICKS = 200_000
"""Ticks of all sequences that are looked at: some seconds."""
MAX_BISECTIONS = 200
CAST = {"real": float, "truth": bool, "whole": int}
Modes = tuple[Any, ...]
Values = tuple[float, ...]
Change = tuple[int, Any, Any]
"""Which of the modes changes, from what to what."""


@dataclass(frozen=True)
class Boundary:
    """An input (its place in a record) of a tick, and two neighbouring values of it that are
    followed by different modes until the tick `last`.
    """

    tick: int
    last: int
    input_index: int
    near: float
    far: float


def generate_boundary_sequences(
    program: Program, sequences: Sequence[Sequence[bytes]], ranges: Mapping[str, Range]
) -> Iterator[list[bytes]]:
    """Yield sequences that end at a border of one of some `sequences`, or beside it.

    Records are those of a `Tape`; a sequence is looked at until its page changes, all of them for
    `MOST_TICKS`. `ranges` are those of inputs by name. Raises ToolMissing, BuildError.
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
    """Yield the numbers at a border: so many on each side."""
    step, cast = boundary.far - boundary.near, ROUNDING_FUNCTIONS[program.number_type]
    yield from (
        cast(boundary.near + k * step) for k in range(1 - NEIGHBOUR_COUNT, NEIGHBOUR_COUNT + 1)
    )


class _BoundarySearch:
    """The C of a Program along sequences, and beside them."""

    def __init__(self, program: Program, ranges: Mapping[str, Range]) -> None:
        """Compile. Raises ToolMissing, BuildError."""
        self._stepper, self._ranges = CompiledStepper(program), ranges
        self._initial = self._stepper.snapshot()
        self._inputs, self._cast = tick_inputs(program), ROUNDING_FUNCTIONS[program.number_type]
        run = (RUN_MODE,) if program.run_modes else ()
        self._modes = (*program.mode_variables().values(), *run)
        self._waits = [v.name for v in program.variables if v.name.startswith("timer.")]
        self._counts: Counter[tuple[Change, int, int]] = Counter()

    def find_boundaries(self, inputs: Sequence[Values]) -> Iterator[Boundary]:
        """Yield borders of a sequence of inputs."""
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
        """Yield borders of each real input of a tick, where what follows until `last` is other."""
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
        """Return two neighbours between the first value of an input and an end of its range."""
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
        """Do some ticks from what was kept; return the modes that follow."""
        self._stepper.restore(snapshot)
        for values in inputs:
            for variable, value in zip(self._inputs, values, strict=False):
                self._stepper.set(variable.name, CAST[variable.type](value))
            self._stepper.run("step")
        return self._current_modes()

    def _current_modes(self) -> Modes:
        """Return the modes, and which waits have begun."""
        get = self._stepper.get
        return (*(get(name) for name in self._modes), *(get(name) > 0 for name in self._waits))
