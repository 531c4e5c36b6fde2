"""Comparison: the interpreter against the compiled C of one automaton, tick by tick, bit by bit.

The C runs as a separate executable; the process of the interpreter loads no compiled code.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from codegen.harness.harness import (
    build_executable,
)
from codegen.harness.instruction_count import InstructionCounts, count_instructions
from codegen.toolchain.compiler import FLAGS
from codegen.toolchain.target_machine import HOST, Machine
from language.ir.number_type import shortest_decimal
from language.ir.program import Program, unqualified_name
from lockstep.tick_log import TickLog

MAX_COUNTED_STEPS = 5000
"""Maximum number of steps whose instructions are counted; each of them is repeated forty times."""


@dataclass(frozen=True)
class Difference:
    """The first value that differs: tick, time [s], mode, signal, and both values with bits."""

    tick: int
    time: float
    mode: str
    signal: str
    engine: str
    compiled: str

    def __str__(self) -> str:
        """Return the difference as one line of text."""
        where = f"t = {self.time:.9g} s (tick {self.tick}), mode `{self.mode}`"
        return f"{where}: `{self.signal}` is {self.engine} in the engine, {self.compiled} in C"


@dataclass(frozen=True)
class Verdict:
    """The result of a comparison: number of ticks, compared values and differing values.

    A tick of a continuous automaton is a major step. `first` is the first difference. `note` tells
    what was not compared, and why. `instructions` holds the counts of the first steps on a target,
    if they were requested.
    """

    name: str
    program: str
    ticks: int
    values: int
    differing: int
    transitions: int
    first: Difference | None
    note: str = ""
    instructions: InstructionCounts | None = None

    @property
    def is_equal(self) -> bool:
        """Tell whether no value differs, also if none was compared."""
        return self.differing == 0


def compare(
    log: TickLog,
    flags: Sequence[str] = FLAGS,
    compiler: str | None = None,
    machine: Machine = HOST,
) -> Verdict:
    """Compile the Program of a tick log, run it on the inputs of the log, and compare all values.

    `compiler` is that of `find_compiler`, or the cross compiler of `machine`. Raises
    MissingToolError, BuildError; ValueError as `compare_output` does.
    """
    with build_executable(log.program, flags, compiler, machine) as target:
        return compare_output(log, machine.run(target, b"".join(log.inputs)))


def add_instruction_counts(verdict: Verdict, log: TickLog, flags: Sequence[str] = FLAGS) -> Verdict:
    """Return a verdict with the instruction counts of the first steps on a Cortex-M4F.

    These are at most MAX_COUNTED_STEPS steps, run in QEMU on the inputs of the log. Raises
    MissingToolError, BuildError.
    """
    records = b"".join(log.inputs[:MAX_COUNTED_STEPS])
    return replace(verdict, instructions=count_instructions(log.program, records, flags))


def compare_output(log: TickLog, output: bytes) -> Verdict:
    """Return the verdict on the output that the C wrote for the inputs of a tick log.

    Values are compared bit by bit, so 0.0 and -0.0 differ, but all NaN are equal (rule 17c). Raises
    ValueError if the output has another length than the values of the log.
    """
    size, ticks = log.record_size, len(log.values)
    differing, first = 0, None
    if len(output) != size * ticks:
        raise ValueError(f"C wrote {len(output)} bytes, {size * ticks} were expected")
    for tick in range(ticks):
        engine, compiled = log.values[tick], output[tick * size : (tick + 1) * size]
        if engine == compiled:
            continue
        positions = _differing_positions(log, engine, compiled)
        differing += len(positions)
        if positions and first is None:
            first = _describe_difference(log, tick, positions[0], compiled)
    return Verdict(
        log.name,
        log.program.name,
        ticks,
        ticks * len(log.names),
        differing,
        log.transitions,
        first,
    )


def skipped_verdict(name: str, program: Program, reason: str) -> Verdict:
    """Return the verdict on an instance that was not compared; `reason` is its note.

    All its counts are 0, so `is_equal` is true.
    """
    return Verdict(name, program.name, 0, 0, 0, 0, None, reason)


def _differing_positions(log: TickLog, engine: bytes, compiled: bytes) -> list[int]:
    """Return the positions of the values that differ in two records.

    All NaN are equal (rule 17c).
    """
    pairs = zip(log.unpack(engine), log.unpack(compiled), strict=True)
    return [
        position
        for position, (a, b) in enumerate(pairs)
        if log.value_bytes(engine, position) != log.value_bytes(compiled, position)
        and (a == a or b == b)
    ]


def _describe_difference(log: TickLog, tick: int, position: int, compiled: bytes) -> Difference:
    """Return the difference at a position of a tick; `compiled` is the record of the C."""
    engine = log.values[tick]
    values, other = log.unpack(engine), log.unpack(compiled)
    mode = values[log.names.index("memory.mode")]
    period = float(log.program.period or log.program.major_step)
    return Difference(
        tick=tick,
        time=log.start + tick * period,
        mode=log.program.mode_name(int(mode)),
        signal=unqualified_name(log.names[position]),
        engine=_format_value(log, values[position], engine, position),
        compiled=_format_value(log, other[position], compiled, position),
    )


def _format_value(log: TickLog, value: float | int, record: bytes, position: int) -> str:
    """Return a value of a record as text, with its bits in hexadecimal."""
    bits = log.value_bytes(record, position)[::-1].hex()
    text = (
        shortest_decimal(value, log.program.number_type)
        if isinstance(value, float)
        else repr(value)
    )
    return f"{text} (0x{bits})"
