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

from codegen.fuzzing import WITHOUT_RANGE, Range
from codegen.harness import fed
from codegen.stepper import CompiledStepper
from language.number import ROUNDING
from language.program import Program, short
from language.run import MODE

REACH = 8
"""Numbers on each side of a border."""
MOST = 3
"""Borders of the same input for the same change of a mode or a wait."""
MOST_TICKS = 200_000
"""Ticks of all sequences that are looked at: some seconds."""
HALVINGS = 200
CAST = {"real": float, "truth": bool, "whole": int}
Modes = tuple[Any, ...]
Values = tuple[float, ...]
Change = tuple[int, Any, Any]
"""Which of the modes changes, from what to what."""


@dataclass(frozen=True)
class Border:
    """An input (its place in a record) of a tick, and two neighbouring values of it that are
    followed by different modes until the tick `last`.
    """

    tick: int
    last: int
    place: int
    near: float
    far: float


def at_borders(
    program: Program, sequences: Sequence[Sequence[bytes]], ranges: Mapping[str, Range]
) -> Iterator[list[bytes]]:
    """Yield sequences that end at a border of one of some `sequences`, or beside it.

    Records are those of a `Tape`; a sequence is looked at until its page changes, all of them for
    `MOST_TICKS`. `ranges` are those of inputs by name. Raises ToolMissing, BuildError.
    """
    record = struct.Struct(f"<{len(fed(program)) + 1}d")
    walk = _Walk(program, ranges)
    left = MOST_TICKS
    for sequence in sequences:
        changed = (k for k, one in enumerate(sequence) if len(one) != record.size)
        known = list(sequence[: next(changed, left)][:left])
        left -= len(known)
        for border in walk.borders([record.unpack(one) for one in known]):
            moved = list(record.unpack(known[border.tick]))
            for value in _around(border, program):
                moved[border.place] = value
                rest = known[border.tick + 1 : border.last + 1]
                yield [*known[: border.tick], record.pack(*moved), *rest]


def _around(border: Border, program: Program) -> Iterator[float]:
    """Yield the numbers at a border: so many on each side."""
    step, cast = border.far - border.near, ROUNDING[program.number]
    yield from (cast(border.near + k * step) for k in range(1 - REACH, REACH + 1))


class _Walk:
    """The C of a Program along sequences, and beside them."""

    def __init__(self, program: Program, ranges: Mapping[str, Range]) -> None:
        """Compile. Raises ToolMissing, BuildError."""
        self._stepper, self._ranges = CompiledStepper(program), ranges
        self._anew = self._stepper.snapshot()
        self._fed, self._cast = fed(program), ROUNDING[program.number]
        run = (MODE,) if program.run_modes else ()
        self._modes = (*program.mode_variables().values(), *run)
        self._waits = [v.name for v in program.variables if v.name.startswith("timer.")]
        self._seen: Counter[tuple[Change, int, int]] = Counter()

    def borders(self, inputs: Sequence[Values]) -> Iterator[Border]:
        """Yield borders of a sequence of inputs."""
        self._stepper.restore(self._anew)
        past = now = self._stepper.snapshot()
        before = self._now()
        for tick, values in enumerate(inputs):
            after = self._through(now, [values])
            past, now, begun = now, self._stepper.snapshot(), past
            changes = {
                (k, *c) for k, c in enumerate(zip(before, after, strict=True)) if c[0] != c[1]
            }
            if changes:
                yield from self._near(inputs, tick, tick, past, changes)
                if tick:
                    yield from self._near(inputs, tick - 1, tick, begun, changes)
            before = after

    def _near(
        self,
        inputs: Sequence[Values],
        tick: int,
        last: int,
        begun: bytes,
        changes: set[Change],
    ) -> Iterator[Border]:
        """Yield borders of each real input of a tick, where what follows until `last` is other."""
        for place, variable in enumerate(self._fed):
            kinds = [(change, place, last - tick) for change in changes]
            if variable.type != "real" or all(self._seen[kind] >= MOST for kind in kinds):
                continue
            ends = self._ranges.get(short(variable.name), WITHOUT_RANGE)
            found = self._between(begun, inputs[tick : last + 1], place, ends)
            if found:
                self._seen.update(kinds)
                yield Border(tick, last, place, *found)

    def _between(
        self, begun: bytes, inputs: Sequence[Values], place: int, ends: Range
    ) -> tuple[float, float] | None:
        """Return two neighbours between the first value of an input and an end of its range."""
        (first, *rest), cast = inputs, self._cast

        def modes(value: float) -> Modes:
            return self._through(begun, [(*first[:place], value, *first[place + 1 :]), *rest])

        near = first[place]
        if not math.isfinite(near):
            return None
        here = modes(near)
        others = [end for end in map(cast, ends) if modes(end) != here]
        if not others:
            return None
        far = others[0]
        for _ in range(HALVINGS):
            middle = cast(near + 0.5 * (far - near))
            if middle in (near, far):
                return near, far
            near, far = (middle, far) if modes(middle) == here else (near, middle)
        return None

    def _through(self, begun: bytes, inputs: Sequence[Values]) -> Modes:
        """Do some ticks from what was kept; return the modes that follow."""
        self._stepper.restore(begun)
        for values in inputs:
            for variable, value in zip(self._fed, values, strict=False):
                self._stepper.set(variable.name, CAST[variable.type](value))
            self._stepper.run("step")
        return self._now()

    def _now(self) -> Modes:
        """Return the modes, and which waits have begun."""
        get = self._stepper.get
        return (*(get(name) for name in self._modes), *(get(name) > 0 for name in self._waits))
