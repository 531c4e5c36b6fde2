"""Fuzzing: replays every sequence that libFuzzer tried on generated C in the interpreter."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass

from codegen.coverage.libfuzzer import Range, WordValues, decode_sequence, run_fuzzer, word_table
from codegen.harness.harness import tick_inputs
from engine.interpreter.interpreter import Interpreter
from engine.simulation.simulate import CONVERTER_OF_TYPE
from language.ir.program import Program
from lockstep.comparison import Difference, compare
from lockstep.tick_log import TickLog

RUNS, TICKS, SEED = 20_000, 24, 1
"""Default number of executions of libFuzzer, of ticks of a sequence, and the default seed."""
MAX_COMPARED = 20
"""Maximum number of sequences with a different checksum that are compared value by value."""


@dataclass(frozen=True)
class FuzzReport:
    """The result of fuzzing.

    `runs` executions gave `distinct` sequences with `ticks` and `transitions` in total, which
    covered `edges` of the C and reached `modes`. `findings` are the errors that sanitizers
    reported. `differing` is the number of sequences whose values differ, `first` the first
    difference.
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
        """Tell whether at least one tick was executed, without a finding or difference."""
        return self.ticks > 0 and not self.findings and not self.differing


def fuzz(
    program: Program,
    ranges: Mapping[str, Range],
    runs: int = RUNS,
    ticks: int = TICKS,
    seed: int = SEED,
) -> FuzzReport:
    """Run libFuzzer on the C of a sampled Program and compare every sequence with the interpreter.

    Equal sequences are replayed once. Checksums are compared first; the first MAX_COMPARED that
    differ are compared value by value, later ones count as differing. `ticks` is the maximum of a
    sequence. `ranges` gives ranges of inputs by name. Raises MissingToolError, BuildError.
    """
    run = run_fuzzer(program, ranges, runs, ticks, seed)
    table = word_table(program, ranges)
    empty_log = TickLog(program, program.name)
    tick_count = transitions = differing = 0
    modes: set[int] = set()
    first: Difference | None = None
    known = dict(run.sequences)
    for sequence, checksum in known.items():
        log = _replay_sequence(empty_log, table, sequence, modes)
        tick_count += len(log.values)
        transitions += log.transitions
        if zlib.crc32(b"".join(log.values)) == checksum:
            continue
        verdict = compare(log) if differing < MAX_COMPARED else None
        if verdict is None or not verdict.is_equal:
            differing += 1
            first = first or (verdict.first if verdict else None)
    names = tuple(mode.name for mode in program.modes if mode.number in modes)
    return FuzzReport(
        program.name,
        len(run.sequences),
        len(known),
        tick_count,
        transitions,
        run.edges,
        names,
        run.findings,
        differing,
        first,
    )


def _replay_sequence(
    empty_log: TickLog, table: list[WordValues], sequence: bytes, modes: set[int]
) -> TickLog:
    """Return the tick log of a sequence in the interpreter.

    Modes that it reaches are added to `modes`.
    """
    program, log = empty_log.program, copy(empty_log)
    log.inputs, log.values, engine = [], [], Interpreter(program)
    inputs = [(v.name, CONVERTER_OF_TYPE[v.type]) for v in tick_inputs(program)]
    regions = tuple(program.mode_variables().values())
    for values in decode_sequence(program, table, sequence):
        for (name, kind), value in zip(inputs, values, strict=True):
            engine.set(name, kind(value))
        engine.run("step")
        log.record_tick(engine)
        modes.update(engine.get(name) for name in regions)
    return log
