"""Compare: the interpreter and the compiled C of one automaton, tick by tick, bit by bit.

The process that interprets loads no compiled code of ours: the C runs as a program of its own.
"""

from __future__ import annotations

import itertools
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from codegen.build import FLAGS
from codegen.harness import executable, fed, observed, tunable
from codegen.instructions import Instructions, instructions
from codegen.machine import HOST, Machine
from engine.firing import fired
from engine.interpreter import Stepper
from language.number import NumberType, decimal
from language.program import Program, short

FORMAT: Mapping[NumberType, str] = {"float64": "d", "float32": "f"}
"""How a record keeps a real; whole numbers and truth values take 8 bytes."""
MOST_COUNTED = 5000
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
    instructions: Instructions | None = None

    @property
    def is_equal(self) -> bool:
        """Tell whether no bit differs."""
        return self.differing == 0


@dataclass
class Tape:
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
        self._fed = tuple(variable.name for variable in fed(self.program))
        self._observed = observed(self.program)
        self._names = tuple(item.name for item in self._observed)
        real = FORMAT[self.program.number]
        kinds = [real if item.kind == "real" else "q" for item in self._observed]
        self._input = struct.Struct(f"<{len(self._fed) + 1}d")
        self._tunable = tuple(constant.name for constant in tunable(self.program))
        self._page = [constant.value for constant in tunable(self.program)]
        self._page_record = struct.Struct(f"<{len(self._page)}d")
        self._value = struct.Struct(f"<{''.join(kinds)}")
        ends = [0, *itertools.accumulate(struct.calcsize(f"<{kind}") for kind in kinds)]
        self._places = [slice(*ends[k : k + 2]) for k in range(len(kinds))]

    def record(self, stepper: Stepper) -> None:
        """Keep the inputs, a new calibration and the values of the tick that was just done."""
        inputs = [float(stepper.get(name)) for name in self._fed]
        page = [stepper.get(name) for name in self._tunable]
        record = self._input.pack(*inputs, float(page != self._page))
        if page != self._page:
            record += self._page_record.pack(*page)
            self._page = page
        self.inputs.append(record)
        self.values.append(self._value.pack(*[stepper.get(n) for n in self._names]))
        self.transitions += self._taken(stepper)

    def _taken(self, stepper: Stepper) -> int:
        """Return how many transitions fired in a tick; of a step whether a mode is another."""
        if self.program.period is not None:
            return len(fired(self.program, stepper))
        before = self._modes
        self._modes = tuple(stepper.get(name) for name in self.program.mode_variables().values())
        return int(before not in ((), self._modes))

    def unpack(self, record: bytes) -> tuple[float | int, ...]:
        """Return the values of a record."""
        return self._value.unpack(record)

    def word(self, record: bytes, position: int) -> bytes:
        """Return the bytes of one value of a record."""
        return record[self._places[position]]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the values of a record."""
        return self._names

    @property
    def size(self) -> int:
        """The bytes of a record of values."""
        return self._value.size


def compare(
    tape: Tape,
    flags: Sequence[str] = FLAGS,
    compiler: str | None = None,
    machine: Machine = HOST,
) -> Verdict:
    """Compile the tape's program, run it on the tape's inputs and compare every value.

    Raises ToolMissing, BuildError.
    """
    with executable(tape.program, flags, compiler, machine) as target:
        return judged(tape, machine.run(target, b"".join(tape.inputs)))


def counted(verdict: Verdict, tape: Tape, flags: Sequence[str] = FLAGS) -> Verdict:
    """Return a verdict with the instructions of its first steps on a Cortex-M4F."""
    records = b"".join(tape.inputs[:MOST_COUNTED])
    return replace(verdict, instructions=instructions(tape.program, records, flags))


def judged(tape: Tape, output: bytes) -> Verdict:
    """Return the verdict on what the C of the tape's program wrote for the tape's inputs."""
    size, ticks = tape.size, len(tape.values)
    differing, first = 0, None
    if len(output) != size * ticks:
        raise ValueError(f"C wrote {len(output)} bytes, {size * ticks} were expected")
    for tick in range(ticks):
        ours, theirs = tape.values[tick], output[tick * size : (tick + 1) * size]
        if ours == theirs:
            continue
        different = _different(tape, ours, theirs)
        differing += len(different)
        if different and first is None:
            first = _difference(tape, tick, different[0], theirs)
    return Verdict(
        tape.name,
        tape.program.name,
        ticks,
        ticks * len(tape.names),
        differing,
        tape.transitions,
        first,
    )


def not_compared(name: str, program: Program, why: str) -> Verdict:
    """Return the verdict on an instance of which nothing can be compared."""
    return Verdict(name, program.name, 0, 0, 0, 0, None, why)


def _different(tape: Tape, ours: bytes, theirs: bytes) -> list[int]:
    """Return the positions that differ; all NaNs are one (rule 17c)."""
    pairs = zip(tape.unpack(ours), tape.unpack(theirs), strict=True)
    return [
        position
        for position, (a, b) in enumerate(pairs)
        if tape.word(ours, position) != tape.word(theirs, position) and (a == a or b == b)
    ]


def _difference(tape: Tape, tick: int, position: int, theirs: bytes) -> Difference:
    ours = tape.values[tick]
    values, other = tape.unpack(ours), tape.unpack(theirs)
    mode = values[tape.names.index("memory.mode")]
    period = float(tape.program.period or tape.program.major_step)
    return Difference(
        tick=tick,
        time=tape.start + tick * period,
        mode=tape.program.mode_name(int(mode)),
        signal=short(tape.names[position]),
        engine=_shown(tape, values[position], ours, position),
        compiled=_shown(tape, other[position], theirs, position),
    )


def _shown(tape: Tape, value: float | int, record: bytes, position: int) -> str:
    bits = tape.word(record, position)[::-1].hex()
    text = decimal(value, tape.program.number) if isinstance(value, float) else repr(value)
    return f"{text} (0x{bits})"
