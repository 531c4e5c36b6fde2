"""Importer: FMUs through FMPy, the same calls for both versions of FMI."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence
from ctypes import byref, c_char, c_size_t, c_uint8, c_void_p
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi3 import FMU3Slave

from codegen.exchange.fmi.variable import Version
from codegen.harness.harness import tick_inputs, tunable_constants
from language.ir.program import Program, unqualified_name
from lockstep.tick_log import TickLog

Values = Mapping[str, float]
"""Truths are 0 and 1; what is read back is float, int or bool."""


@dataclass(frozen=True)
class UnpackedFmu:
    """An FMU in a folder, and what its description says."""

    version: Version
    folder: Path
    description: Any

    @property
    def variables(self) -> dict[str, Any]:
        """The variables by name."""
        return {variable.name: variable for variable in self.description.modelVariables}


def unpack_fmu(packed: bytes, folder: Path, version: Version) -> UnpackedFmu:
    """Return an FMU in a new folder."""
    folder.mkdir()
    (folder / "packed.fmu").write_bytes(packed)
    extract(str(folder / "packed.fmu"), str(folder / "unpacked"))
    description = read_model_description(str(folder / "unpacked"))
    return UnpackedFmu(version, folder / "unpacked", description)


@dataclass
class Importer:
    """One instance of an FMU: variables by name, messages as they came."""

    fmu: UnpackedFmu
    name: str = "one"
    messages: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Load the library and make an instance. Raises what FMPy raises."""
        made = FMU2Slave if self.fmu.version == 2 else FMU3Slave
        self.prefix = f"fmi{self.fmu.version}"
        self.slave: Any = made(
            guid=self.fmu.description.guid,
            unzipDirectory=str(self.fmu.folder),
            modelIdentifier=self.fmu.description.coSimulation.modelIdentifier,
            instanceName=self.name,
        )
        self.variables = self.fmu.variables
        if self.fmu.version == 2:
            self.callbacks = fmi2CallbackFunctions()
            self.callbacks.logger = fmi2CallbackLoggerTYPE(
                lambda *words: self._log_message(words[4])
            )
            self.slave.instantiate(callbacks=self.callbacks)
        else:
            self.slave.instantiate(logMessage=lambda *words: self._log_message(words[3]))

    def _log_message(self, message: bytes) -> None:
        self.messages.append(message.decode())

    def call(self, name: str, *arguments: Any) -> Any:
        """Call a function of the standard on the instance: `DoStep` without its prefix."""
        return getattr(self.slave, f"{self.prefix}{name}")(self.slave.component, *arguments)

    def enter(self, start: float = 0.0, stop: float | None = None) -> None:
        """Enter initialization mode."""
        if self.fmu.version == 2:
            self.slave.setupExperiment(startTime=start, stopTime=stop)
            self.slave.enterInitializationMode()
        else:
            self.slave.enterInitializationMode(startTime=start, stopTime=stop)

    def start(self, values: Values, start: float = 0.0, stop: float | None = None) -> None:
        """Go through initialization mode with some values."""
        self.enter(start, stop)
        self.set(values)
        self.slave.exitInitializationMode()

    def step(self, point: float, size: float) -> None:
        """Do a communication step."""
        self.slave.doStep(point, size)

    def set(self, values: Values) -> None:
        """Set variables by name."""
        for access, names in self._grouped(values):
            given = [self._to_c_value(access, values[name]) for name in names]
            getattr(self.slave, f"set{access}")(self._references(names), given)

    def get(self, names: Iterable[str]) -> dict[str, float]:
        """Return variables by name."""
        found: dict[str, float] = {}
        for access, group in self._grouped(names):
            read = getattr(self.slave, f"get{access}")(self._references(group))
            found |= dict(zip(group, read, strict=True))
        return found

    def close(self) -> None:
        """Free the instance; its library stays, others may use it."""
        self.call("FreeInstance")

    def save_state(self) -> c_void_p:
        """Return a state that was saved."""
        state = c_void_p()
        self.call(self._state("GetFMUState"), byref(state))
        return state

    def restore(self, state: c_void_p) -> None:
        """Go back to a state."""
        self.call(self._state("SetFMUState"), state)

    def serialise_state(self, state: c_void_p) -> bytes:
        """Return a state as bytes."""
        size = c_size_t()
        self.call(self._state("SerializedFMUStateSize"), state, byref(size))
        room = (c_char * size.value)() if self.fmu.version == 2 else self._bytes(bytes(size.value))
        self.call(self._state("SerializeFMUState"), state, room, size)
        return bytes(room)

    def deserialise_state(self, data: bytes) -> c_void_p:
        """Return a state from bytes."""
        state = c_void_p()
        name = "DeSerializeFMUstate" if self.fmu.version == 2 else "DeserializeFMUState"
        self.call(name, self._bytes(data), len(data), byref(state))
        return state

    def _bytes(self, data: bytes) -> Any:
        kind = c_char if self.fmu.version == 2 else c_uint8
        return (kind * len(data)).from_buffer_copy(data)

    def _state(self, name: str) -> str:
        return name.replace("FMUState", "FMUstate") if self.fmu.version == 2 else name

    def _references(self, names: Sequence[str]) -> list[int]:
        return [self.variables[name].valueReference for name in names]

    def _grouped(self, names: Iterable[str]) -> Iterator[tuple[str, list[str]]]:
        groups: dict[str, list[str]] = {}
        for name in names:
            groups.setdefault(self._access(self.variables[name].type), []).append(name)
        yield from groups.items()

    def _access(self, kind: str) -> str:
        if kind == "Enumeration":
            return "Integer" if self.fmu.version == 2 else "Int64"
        return kind

    @staticmethod
    def _to_c_value(access: str, value: float) -> float:
        if access == "Boolean":
            return bool(value)
        return value if access in ("Real", "Float32", "Float64") else int(value)


def bits(value: float) -> bytes:
    """Return the bits of a value; a float32 is a double without loss."""
    return struct.pack("<d", value)


def inputs_of(tape: TickLog) -> Iterator[tuple[dict[str, float], dict[str, float]]]:
    """Yield what each tick of a tape read: its inputs, and a page where it changed."""
    names = [_shown(variable.name) for variable in tick_inputs(tape.program)]
    page = [unqualified_name(constant.name) for constant in tunable_constants(tape.program)]
    for record in tape.inputs:
        numbers = struct.unpack(f"<{len(record) // 8}d", record)
        rest = numbers[len(names) + 1 :]
        inputs = dict(zip(names, numbers, strict=False))
        yield inputs, dict(zip(page, rest, strict=True)) if rest else {}


def compared(program: Program, fmu: UnpackedFmu) -> dict[str, str]:
    """Return the variables of an FMU that a tape has, too: its name there by name here."""
    sources = {wire.name: wire.source for wire in program.outputs}
    found = {}
    for name, variable in fmu.variables.items():
        if variable.causality == "output":
            found[name] = sources[name.removeprefix("output.")]
        elif variable.causality == "local" and not name.startswith("fault."):
            found[name] = name if "." in name else f"memory.{name}"
    return found


def count_differences(importer: Importer, tape: TickLog, every: int = 1) -> tuple[int, list[str]]:
    """Drive an FMU as a tape was; return how many values were compared, and which differ.

    `every` ticks are done by one step: the tape then holds its inputs over them.
    """
    period = float(tape.program.period or tape.program.major_step)
    same = compared(tape.program, importer.fmu)
    places = {name: tape.names.index(source) for name, source in same.items()}
    values, different = 0, []
    for tick, (inputs, page) in enumerate(inputs_of(tape)):
        if tick == 0:
            importer.start(inputs)
        elif tick % every == 0:
            importer.set({**inputs, **page})
            importer.step((tick - every) * period, every * period)
        else:
            continue
        theirs = tape.unpack(tape.values[tick])
        for name, value in importer.get(places).items():
            values += 1
            if bits(value) != bits(theirs[places[name]]):
                different.append(
                    f"tick {tick}: {name} is {value}, {theirs[places[name]]} on the tape"
                )
    return values, different


def _shown(name: str) -> str:
    return name.removeprefix("input.")
