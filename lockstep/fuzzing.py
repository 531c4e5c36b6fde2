"""Fuzzing: every sequence that libFuzzer tried on generated C, done again by the engine."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass

from codegen.fuzzing import Range, Words, fuzzed, values_of, words
from codegen.harness import fed
from engine.interpreter import Interpreter
from engine.simulate import CONVERT
from language.program import Program
from lockstep.compare import Difference, Tape, compare

RUNS, TICKS, SEED = 20_000, 24, 1
MOST_LOOKED_AT = 20
"""Sequences with another sum of which values are compared one by one."""


@dataclass(frozen=True)
class Fuzzed:
    """What came of fuzzing: sequences that `runs` tried, how many differ from each other, their
    ticks and transitions, `edges` of the C that they came along, the `modes` that they were in,
    what sanitizers found, and `differing` sequences with the `first` value that is another one.
    """

    program: str
    runs: int
    distinct: int
    ticks: int
    transitions: int
    edges: int
    modes: tuple[str, ...]
    findings: tuple[str, ...]
    differing: int
    first: Difference | None

    @property
    def is_clean(self) -> bool:
        """Tell whether something was tried, and nothing was found."""
        return self.ticks > 0 and not self.findings and not self.differing


def fuzz(
    program: Program,
    ranges: Mapping[str, Range],
    runs: int = RUNS,
    ticks: int = TICKS,
    seed: int = SEED,
) -> Fuzzed:
    """Let libFuzzer look for ways through the C of a sampled Program, and compare each with the
    engine's; `ranges` are those of inputs by name. Raises ToolMissing, BuildError.
    """
    found = fuzzed(program, ranges, runs, ticks, seed)
    table = words(program, ranges)
    blank = Tape(program, program.name)
    done = taken = differing = 0
    modes: set[int] = set()
    first: Difference | None = None
    known = dict(found.tried)
    for sequence, checksum in known.items():
        tape = _taped(blank, table, sequence, modes)
        done, taken = done + len(tape.values), taken + tape.transitions
        if zlib.crc32(b"".join(tape.values)) == checksum:
            continue
        verdict = compare(tape) if differing < MOST_LOOKED_AT else None
        if verdict is None or not verdict.is_equal:
            differing += 1
            first = first or (verdict.first if verdict else None)
    names = tuple(mode.name for mode in program.modes if mode.number in modes)
    return Fuzzed(
        program.name,
        len(found.tried),
        len(known),
        done,
        taken,
        found.edges,
        names,
        found.findings,
        differing,
        first,
    )


def _taped(blank: Tape, table: list[Words], sequence: bytes, modes: set[int]) -> Tape:
    """Return what the engine does with a sequence; the modes that it is in are noted."""
    program, tape = blank.program, copy(blank)
    tape.inputs, tape.values, engine = [], [], Interpreter(program)
    inputs = [(v.name, CONVERT[v.type]) for v in fed(program)]
    regions = tuple(program.mode_variables().values())
    for values in values_of(program, table, sequence):
        for (name, kind), value in zip(inputs, values, strict=True):
            engine.set(name, kind(value))
        engine.run("step")
        tape.record(engine)
        modes.update(engine.get(name) for name in regions)
    return tape
