"""CAN database: inputs and outputs of an automaton as messages of a bus, in a DBC."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from codegen.asam.a2l import safe
from codegen.asam.conversion import TRUTH, Conversion, conversion_of
from codegen.names import c_type
from language.missing import ToolMissing
from language.printing import digest
from language.program import Program, Variable, short

BITS = {
    "bool": 1, "uint8_t": 8, "int16_t": 16, "uint16_t": 16, "int32_t": 32, "uint32_t": 32,
    "float": 32, "double": 64,
}  # fmt: skip
REAL, UNSIGNED = ("float", "double"), ("bool", "uint8_t", "uint16_t", "uint32_t")
CLASSIC, FLEXIBLE = 8, 64
"""Bytes of a frame, of CAN and of CAN FD."""
FD_LENGTHS = (8, 12, 16, 20, 24, 32, 48, 64)
FIRST = 0x100
HIGHEST, HIGHEST_EXTENDED = 0x7FF, 0x1FFFFFFF
"""Highest identifiers of 11 and of 29 bits."""
MILLISECONDS = 1000
"""In a second: what a DBC counts cycles in."""
Range = tuple[float, float]
EMPTY = """\
VERSION "{digest}"
BS_:
BU_: {name}
CM_ BU_ {name} "digest {digest}";
BA_DEF_ "BusType" STRING ;
BA_DEF_DEF_ "BusType" "CAN";
BA_ "BusType" "{bus}";
"""
"""A DBC without messages: what tools read of the bus decides how frames are written."""
OTHERS = "Vector__XXX"
"""What a DBC calls a node that it does not name."""


@dataclass(frozen=True)
class Carried:
    """A value on the bus: its name, C type and how it is shown; `about` it, and its `range`."""

    name: str
    kind: str
    conversion: Conversion
    about: str = ""
    range: Range | None = None


def dbc(
    program: Program, ranges: Mapping[str, Range], first: int = FIRST, is_fd: bool = False
) -> str:
    """Return a DBC: messages `X_In` that the automaton receives and `X_Out` that it sends.

    Each value has the bits that it has in C, least significant byte first; frames follow each other
    from the identifier `first`. `ranges` [SI] are those of inputs by name. Raises
    ValueError where identifiers run out, ToolMissing.
    """
    try:
        from cantools.database import Database, load_string
    except ModuleNotFoundError:
        raise ToolMissing("a DBC needs cantools: pip install 'modewright[can]'") from None
    room = 8 * (FLEXIBLE if is_fd else CLASSIC)
    bus = "CAN FD" if is_fd else "CAN"
    known = load_string(EMPTY.format(digest=digest(program), name=program.name, bus=bus), "dbc")
    assert isinstance(known, Database)
    messages: list[Any] = []
    for way, values in (("In", _inputs(program, ranges)), ("Out", _outputs(program))):
        frames = _frames(list(values), room)
        for k, frame in enumerate(frames, start=1):
            name = f"{program.name}_{way}" + (f"_{k}" if len(frames) > 1 else "")
            number = first + len(messages)
            if not 0 <= number <= HIGHEST_EXTENDED:
                raise ValueError(f"0x{number:X} is no identifier of a CAN frame")
            messages.append(_message(program, name, number, frame, way == "Out", is_fd))
    known.messages.extend(messages)
    known.refresh()
    return str(known.as_dbc_string())


def _inputs(program: Program, ranges: Mapping[str, Range]) -> Iterator[Carried]:
    for variable in program.inputs:
        name = short(variable.name)
        yield _carried(name, variable, program, ranges.get(name))


def _outputs(program: Program) -> Iterator[Carried]:
    variables = {variable.name: variable for variable in program.variables}
    for wire in program.outputs:
        variable = variables.get(wire.source) or Variable(wire.source, wire.type, wire.unit)
        yield _carried(wire.name, variable, program, None)


def _carried(name: str, variable: Variable, program: Program, given: Range | None) -> Carried:
    kind = c_type(variable, program.number)
    return Carried(name, kind, conversion_of(variable, program), safe(variable.about), given)


def _frames(values: Sequence[Carried], room: int) -> list[list[Carried]]:
    """Return values frame by frame, in their order, as many as there is room for [bits]."""
    frames: list[list[Carried]] = []
    for value in values:
        if not frames or sum(BITS[v.kind] for v in (*frames[-1], value)) > room:
            frames.append([])
        frames[-1].append(value)
    return frames


def _message(
    program: Program, name: str, identifier: int, values: list[Carried], is_sent: bool, is_fd: bool
) -> Any:
    from cantools.database import Message

    signals, at = [], 0
    for value in values:
        signals.append(_signal(value, at, OTHERS if is_sent else program.name))
        at += BITS[value.kind]
    size = -(-at // 8)
    length = next(n for n in FD_LENGTHS if n >= size) if is_fd and size > CLASSIC else size
    return Message(
        frame_id=identifier,
        name=name,
        length=length,
        signals=signals,
        senders=[program.name if is_sent else OTHERS],
        is_extended_frame=identifier > HIGHEST,
        is_fd=is_fd,
        cycle_time=_cycle(program),
    )


def _cycle(program: Program) -> int | None:
    """Return the period [ms] of an automaton; None where it has none, or a part of one."""
    period = (program.period or 0) * MILLISECONDS
    return int(period) if period and period.denominator == 1 else None


def _signal(value: Carried, start: int, receiver: str) -> Any:
    from cantools.database import Signal
    from cantools.database.conversion import BaseConversion

    names = () if value.conversion == TRUTH else value.conversion.names
    low, high = value.range or (None, None)
    return Signal(
        name=value.name,
        start=start,
        length=BITS[value.kind],
        byte_order="little_endian",
        is_signed=value.kind not in UNSIGNED,
        conversion=BaseConversion.factory(
            scale=value.conversion.factor,
            offset=0,
            choices=OrderedDict(names) or None,
            is_float=value.kind in REAL,
        ),
        minimum=low,
        maximum=high,
        unit=value.conversion.unit or None,
        comment=value.about or None,
        receivers=[receiver],
    )
