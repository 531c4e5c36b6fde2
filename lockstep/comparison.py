"""Compare: the interpreter and the compiled C of one automaton, tick by tick, bit by bit.

The process that interprets loads no compiled code of ours: the C runs as a program of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from codegen.harness.harness import (
    build_executable,
)
from codegen.harness.instruction_count import InstructionCounts, count_instructions
from codegen.toolchain.compiler import FLAGS
from codegen.toolchain.machine import HOST, Machine
from language.ir.number_type import shortest_decimal
from language.ir.program import Program, unqualified_name
from lockstep.tick_log import TickLog

MAX_COUNTED_STEPS = 5000
"""Steps whose instructions are counted: each of them is repeated forty times."""


@dataclass(frozen=True)
class Difference:
    """The first value that differs: where, and both bit patterns."""

    tick: int
    time: float
    mode: str
    signal: str
    engine: str
    compiled: str

    def __str__(self) -> str:
        """Return one line."""
        where = f"t = {self.time:.9g} s (tick {self.tick}), mode `{self.mode}`"
        return f"{where}: `{self.signal}` is {self.engine} in the engine, {self.compiled} in C"


@dataclass(frozen=True)
class Verdict:
    """How many ticks and values were compared, how many differ, and the first that does.

    Of a continuous automaton a tick is a major step; `note` says what was not compared, and why.
    `instructions` of the first steps are counted on a target.
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
        """Tell whether no bit differs."""
        return self.differing == 0


def compare(
    log: TickLog,
    flags: Sequence[str] = FLAGS,
    compiler: str | None = None,
    machine: Machine = HOST,
) -> Verdict:
    """Compile the tape's program, run it on the tape's inputs and compare every value.

    Raises ToolMissing, BuildError.
    """
    with build_executable(log.program, flags, compiler, machine) as target:
        return compare_output(log, machine.run(target, b"".join(log.inputs)))


def add_instruction_counts(verdict: Verdict, log: TickLog, flags: Sequence[str] = FLAGS) -> Verdict:
    """Return a verdict with the instructions of its first steps on a Cortex-M4F."""
    records = b"".join(log.inputs[:MAX_COUNTED_STEPS])
    return replace(verdict, instructions=count_instructions(log.program, records, flags))


def compare_output(log: TickLog, output: bytes) -> Verdict:
    """Return the verdict on what the C of the tape's program wrote for the tape's inputs."""
    size, ticks = log.record_size, len(log.values)
    differing, first = 0, None
    if len(output) != size * ticks:
        raise ValueError(f"C wrote {len(output)} bytes, {size * ticks} were expected")
    for tick in range(ticks):
        ours, theirs = log.values[tick], output[tick * size : (tick + 1) * size]
        if ours == theirs:
            continue
        different = _differing_positions(log, ours, theirs)
        differing += len(different)
        if different and first is None:
            first = _describe_difference(log, tick, different[0], theirs)
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
    """Return the verdict on an instance of which nothing can be compared."""
    return Verdict(name, program.name, 0, 0, 0, 0, None, reason)


def _differing_positions(log: TickLog, ours: bytes, theirs: bytes) -> list[int]:
    """Return the positions that differ; all NaNs are one (rule 17c)."""
    pairs = zip(log.unpack(ours), log.unpack(theirs), strict=True)
    return [
        position
        for position, (a, b) in enumerate(pairs)
        if log.value_bytes(ours, position) != log.value_bytes(theirs, position)
        and (a == a or b == b)
    ]


def _describe_difference(log: TickLog, tick: int, position: int, theirs: bytes) -> Difference:
    ours = log.values[tick]
    values, other = log.unpack(ours), log.unpack(theirs)
    mode = values[log.names.index("memory.mode")]
    period = float(log.program.period or log.program.major_step)
    return Difference(
        tick=tick,
        time=log.start + tick * period,
        mode=log.program.mode_name(int(mode)),
        signal=unqualified_name(log.names[position]),
        engine=_format_value(log, values[position], ours, position),
        compiled=_format_value(log, other[position], theirs, position),
    )


def _format_value(log: TickLog, value: float | int, record: bytes, position: int) -> str:
    bits = log.value_bytes(record, position)[::-1].hex()
    text = (
        shortest_decimal(value, log.program.number_type)
        if isinstance(value, float)
        else repr(value)
    )
    return f"{text} (0x{bits})"
