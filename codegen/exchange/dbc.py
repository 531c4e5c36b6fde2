"""CAN database: the inputs and outputs of an automaton as CAN messages, in a DBC file."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from codegen.emit.c_names import c_type
from codegen.exchange.a2l.compu_method import TRUTH, Conversion, conversion_of
from codegen.exchange.a2l.writer import sanitise_string
from language.ir.printer import digest
from language.ir.program import Program, Variable, unqualified_name
from language.text.diagnostic import MissingToolError

BIT_LENGTH = {
    "bool": 1, "uint8_t": 8, "int16_t": 16, "uint16_t": 16, "int32_t": 32, "uint32_t": 32,
    "float": 32, "double": 64,
}  # fmt: skip
"""The length of a signal [bits] by its C type."""
REAL_TYPES, UNSIGNED_TYPES = ("float", "double"), ("bool", "uint8_t", "uint16_t", "uint32_t")
"""C types of floating-point and of unsigned signals."""
CAN_BYTES, CAN_FD_BYTES = 8, 64
"""Capacity of a CAN and of a CAN FD frame [bytes]."""
FD_LENGTHS = (8, 12, 16, 20, 24, 32, 48, 64)
"""Frame lengths of CAN FD [bytes]."""
FIRST_IDENTIFIER = 0x100
"""The identifier of the first message by default."""
MAX_STANDARD_ID, MAX_EXTENDED_ID = 0x7FF, 0x1FFFFFFF
"""Largest identifiers of 11 and of 29 bits."""
MS_PER_SECOND = 1000
"""Milliseconds in a second: a DBC gives cycle times in ms."""
Range = tuple[float, float]
EMPTY_DBC = """\
VERSION "{digest}"
BS_:
BU_: {name}
CM_ BU_ {name} "digest {digest}";
BA_DEF_ "BusType" STRING ;
BA_DEF_DEF_ "BusType" "CAN";
BA_ "BusType" "{bus}";
"""
"""A DBC without messages. The tool reads the type of the bus from it, which decides how frames are
written."""
UNNAMED_NODE = "Vector__XXX"
"""The name in a DBC of a node that has none."""


@dataclass(frozen=True)
class BusSignal:
    """A signal on the bus: its name, C type (`kind`), conversion, comment and range."""

    name: str
    kind: str
    conversion: Conversion
    about: str = ""
    range: Range | None = None


def emit_dbc(
    program: Program,
    ranges: Mapping[str, Range],
    first: int = FIRST_IDENTIFIER,
    is_fd: bool = False,
) -> str:
    """Return a DBC file with messages `X_In` that the automaton receives and `X_Out` that it sends.

    Each signal has the bits of its C type (BIT_LENGTH), little-endian, in the order of the inputs
    or outputs, without gaps. Signals that do not fit into a frame of CAN_BYTES (CAN_FD_BYTES if
    `is_fd`) are split over messages `X_In_1`, `X_In_2` and so on. Identifiers count up from `first`
    over all messages; one above MAX_STANDARD_ID is extended. `ranges` gives ranges [SI] of inputs
    by name; outputs have none. Raises ValueError if an identifier is not from 0 to MAX_EXTENDED_ID;
    MissingToolError if cantools is missing.
    """
    try:
        from cantools.database import Database, load_string
    except ModuleNotFoundError:
        raise MissingToolError("a DBC needs cantools: pip install 'modewright[can]'") from None
    capacity = 8 * (CAN_FD_BYTES if is_fd else CAN_BYTES)
    bus = "CAN FD" if is_fd else "CAN"
    database = load_string(
        EMPTY_DBC.format(digest=digest(program), name=program.name, bus=bus), "dbc"
    )
    assert isinstance(database, Database)
    messages: list[Any] = []
    for direction, values in (
        ("In", _input_signals(program, ranges)),
        ("Out", _output_signals(program)),
    ):
        frames = _pack_frames(list(values), capacity)
        for k, frame in enumerate(frames, start=1):
            name = f"{program.name}_{direction}" + (f"_{k}" if len(frames) > 1 else "")
            number = first + len(messages)
            if not 0 <= number <= MAX_EXTENDED_ID:
                raise ValueError(f"0x{number:X} is no identifier of a CAN frame")
            messages.append(_make_message(program, name, number, frame, direction == "Out", is_fd))
    database.messages.extend(messages)
    database.refresh()
    return str(database.as_dbc_string())


def _input_signals(program: Program, ranges: Mapping[str, Range]) -> Iterator[BusSignal]:
    """Yield the signals of the inputs."""
    for variable in program.inputs:
        name = unqualified_name(variable.name)
        yield _bus_signal(name, variable, program, ranges.get(name))


def _output_signals(program: Program) -> Iterator[BusSignal]:
    """Yield the signals of the outputs, which have no range."""
    variables = {variable.name: variable for variable in program.variables}
    for wire in program.outputs:
        variable = variables.get(wire.source) or Variable(wire.source, wire.type, wire.unit)
        yield _bus_signal(wire.name, variable, program, None)


def _bus_signal(
    name: str, variable: Variable, program: Program, value_range: Range | None
) -> BusSignal:
    """Return a signal with the type, conversion and comment of a variable."""
    kind = c_type(variable, program.number_type)
    return BusSignal(
        name, kind, conversion_of(variable, program), sanitise_string(variable.about), value_range
    )


def _pack_frames(values: Sequence[BusSignal], capacity: int) -> list[list[BusSignal]]:
    """Return the signals of each frame, in their order, with at most `capacity` bits in a frame."""
    frames: list[list[BusSignal]] = []
    for value in values:
        if not frames or sum(BIT_LENGTH[v.kind] for v in (*frames[-1], value)) > capacity:
            frames.append([])
        frames[-1].append(value)
    return frames


def _make_message(
    program: Program,
    name: str,
    identifier: int,
    values: list[BusSignal],
    is_sent: bool,
    is_fd: bool,
) -> Any:
    """Return a message of cantools; the signals follow each other without gaps."""
    from cantools.database import Message

    signals, at = [], 0
    for value in values:
        signals.append(_make_signal(value, at, UNNAMED_NODE if is_sent else program.name))
        at += BIT_LENGTH[value.kind]
    size = -(-at // 8)
    length = next(n for n in FD_LENGTHS if n >= size) if is_fd and size > CAN_BYTES else size
    return Message(
        frame_id=identifier,
        name=name,
        length=length,
        signals=signals,
        senders=[program.name if is_sent else UNNAMED_NODE],
        is_extended_frame=identifier > MAX_STANDARD_ID,
        is_fd=is_fd,
        cycle_time=_cycle_time(program),
    )


def _cycle_time(program: Program) -> int | None:
    """Return the period of an automaton [ms]; None if it has none or if it is no whole number."""
    period = (program.period or 0) * MS_PER_SECOND
    return int(period) if period and period.denominator == 1 else None


def _make_signal(value: BusSignal, start: int, receiver: str) -> Any:
    """Return a signal of cantools that begins at bit `start`."""
    from cantools.database import Signal
    from cantools.database.conversion import BaseConversion

    names = () if value.conversion == TRUTH else value.conversion.names
    low, high = value.range or (None, None)
    return Signal(
        name=value.name,
        start=start,
        length=BIT_LENGTH[value.kind],
        byte_order="little_endian",
        is_signed=value.kind not in UNSIGNED_TYPES,
        conversion=BaseConversion.factory(
            scale=value.conversion.factor,
            offset=0,
            choices=OrderedDict(names) or None,
            is_float=value.kind in REAL_TYPES,
        ),
        minimum=low,
        maximum=high,
        unit=value.conversion.unit or None,
        comment=value.about or None,
        receivers=[receiver],
    )
