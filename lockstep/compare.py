"""Compare: the interpreter and the compiled C of one automaton, tick by tick, bit by bit.

The process that interprets loads no compiled code of ours: the C runs as a program of its own.
"""

from __future__ import annotations

import itertools
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from codegen.harness.harness import (
    build_executable,
    compared_variables,
    tick_inputs,
    tunable_constants,
)
from codegen.harness.instruction_count import InstructionCounts, count_instructions
from codegen.toolchain.compiler import FLAGS
from codegen.toolchain.machine import HOST, Machine
from engine.execution.transition_events import fired_transitions
from engine.interpreter.interpreter import Stepper
from language.ir.number_type import NumberType, shortest_decimal
from language.ir.program import Program, unqualified_name

REAL_FORMAT: Mapping[NumberType, str] = {"float64": "d", "float32": "f"}
"""How a record keeps a real; whole numbers and truth values take 8 bytes."""
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


@dataclass
class TickLog:
    """What one instance read and carried in each tick of the interpreter."""

    program: Program
    name: str
    start: float = 0.0
    inputs: list[bytes] = field(default_factory=list)
    values: list[bytes] = field(default_factory=list)
    transitions: int = 0

    def __post_init__(self) -> None:
        """Prepare the layout of the records."""
        self._modes: tuple[int, ...] = ()
        self._input_names = tuple(variable.name for variable in tick_inputs(self.program))
        self._compared = compared_variables(self.program)
        self._names = tuple(item.name for item in self._compared)
        real = REAL_FORMAT[self.program.number_type]
        kinds = [real if item.kind == "real" else "q" for item in self._compared]
        self._input = struct.Struct(f"<{len(self._input_names) + 1}d")
        self._tunable_names = tuple(constant.name for constant in tunable_constants(self.program))
        self._page = [constant.value for constant in tunable_constants(self.program)]
        self._page_record = struct.Struct(f"<{len(self._page)}d")
        self._value = struct.Struct(f"<{''.join(kinds)}")
        ends = [0, *itertools.accumulate(struct.calcsize(f"<{kind}") for kind in kinds)]
        self._slices = [slice(*ends[k : k + 2]) for k in range(len(kinds))]

    def record_tick(self, stepper: Stepper) -> None:
        """Keep the inputs, a new calibration and the values of the tick that was just done."""
        inputs = [float(stepper.get(name)) for name in self._input_names]
        page = [stepper.get(name) for name in self._tunable_names]
        record = self._input.pack(*inputs, float(page != self._page))
        if page != self._page:
            record += self._page_record.pack(*page)
            self._page = page
        self.inputs.append(record)
        self.values.append(self._value.pack(*[stepper.get(n) for n in self._names]))
        self.transitions += self._count_transitions(stepper)

    def _count_transitions(self, stepper: Stepper) -> int:
        """Return how many transitions fired in a tick; of a step whether a mode is another."""
        if self.program.period is not None:
            return len(fired_transitions(self.program, stepper))
        before = self._modes
        self._modes = tuple(stepper.get(name) for name in self.program.mode_variables().values())
        return int(before not in ((), self._modes))

    def unpack(self, record: bytes) -> tuple[float | int, ...]:
        """Return the values of a record."""
        return self._value.unpack(record)

    def value_bytes(self, record: bytes, position: int) -> bytes:
        """Return the bytes of one value of a record."""
        return record[self._slices[position]]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the values of a record."""
        return self._names

    @property
    def record_size(self) -> int:
        """The bytes of a record of values."""
        return self._value.size


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
