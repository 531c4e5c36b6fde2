"""Description: what a tool may measure and calibrate in the C of a Program, and how it is shown."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from codegen.asam.conversion import COUNT, TRUTH, Conversion, conversion_of
from codegen.names import CNames, c_type
from codegen.source import stepped
from language.number import LARGEST
from language.printing import digest
from language.program import Constant, Program, Variable
from language.units import shown_unit

SELF, PAGE = "Self", "Cal"
"""The structures of a module that a tool reads and writes, as the end of their C type."""
LIMITS: Mapping[str, tuple[float, float]] = {
    "double": (-LARGEST["float64"], LARGEST["float64"]),
    "float": (-LARGEST["float32"], LARGEST["float32"]),
    "bool": (0, 1),
    "uint8_t": (0, 2**8 - 1),
    "uint16_t": (0, 2**16 - 1),
    "int16_t": (-(2**15), 2**15 - 1),
    "int32_t": (-(2**31), 2**31 - 1),
    "uint32_t": (0, 2**32 - 1),
}
GROUP = {"latched": "input", "timer": "memory"}
"""Where a tool finds variables that are not grouped as they are named."""
MEMBER = re.compile(r"^(self->|cal->)")


@dataclass(frozen=True)
class Measurement:
    """A value in the instance: `path` is its place in `X_Self`; `bit` one of a word, -1: all."""

    name: str
    about: str
    group: str
    path: str
    type: str
    conversion: Conversion
    limits: tuple[float, float]
    size: int = 0
    bit: int = -1


@dataclass(frozen=True)
class Axis:
    """The fixed points of one axis of a table."""

    conversion: Conversion
    points: tuple[float, ...]


@dataclass(frozen=True)
class Characteristic:
    """A value, a curve or a map on the page: `path` is its place in `X_Cal`."""

    name: str
    about: str
    group: str
    path: str
    type: str
    conversion: Conversion
    limits: tuple[float, float]
    axes: tuple[Axis, ...] = ()


@dataclass(frozen=True)
class Description:
    """All that a tool may see of one automaton."""

    name: str
    digest: str
    about: str
    measurements: tuple[Measurement, ...]
    characteristics: tuple[Characteristic, ...]

    @property
    def groups(self) -> dict[str, list[Measurement | Characteristic]]:
        """What belongs together, in order."""
        found: dict[str, list[Measurement | Characteristic]] = {}
        every: list[Measurement | Characteristic] = [*self.characteristics, *self.measurements]
        for one in every:
            found.setdefault(one.group, []).append(one)
        return found


def described(program: Program) -> Description:
    """Return what a tool may measure and calibrate in the C of a Program."""
    used = stepped(program)
    place = CNames(used, solved="cal->solved.")
    measured = [
        found
        for variable in used.variables
        if (found := _measurement(variable, used, place)) is not None
    ]
    derived = [_derived(c, used, place) for c in used.constants if c.kind == "derived"]
    page = [
        _characteristic(c, used, place) for c in used.constants if c.kind in ("tunable", "solved")
    ]
    pace = f"every {float(used.period):g} s" if used.period else "every major step"
    return Description(
        used.name,
        digest(program),
        f"{used.name}, {pace}",
        (*measured, *derived, *_faults(used)),
        tuple(page),
    )


def _measurement(variable: Variable, program: Program, place: CNames) -> Measurement | None:
    """Return a variable that the instance keeps; None for others."""
    text = place(variable.name)
    if not text.startswith("self->"):
        return None
    group = variable.name.partition(".")[0]
    kind = c_type(variable, program.number)
    path = MEMBER.sub("", text)
    return Measurement(
        f"{program.name}.{variable.name}",
        variable.about or f"{shown_unit(variable.unit)}",
        GROUP.get(group, group),
        path,
        kind,
        conversion_of(variable, program),
        variable.range or LIMITS[kind],
        variable.size,
    )


def _derived(constant: Constant, program: Program, place: CNames) -> Measurement:
    path = MEMBER.sub("", place(constant.name))
    kind = c_type(constant, program.number)
    shown = conversion_of(constant, program)
    about = constant.about or constant.key
    return Measurement(
        f"{program.name}.{constant.name}", about, "derived", path, kind, shown, LIMITS[kind]
    )


def _faults(program: Program) -> list[Measurement]:
    """Return the bits of the fault word, each by its name."""
    name, kind = f"{program.name}.memory.faults", "uint32_t"
    return [
        Measurement(
            f"{name}.{fault}", f"fault {fault}", "fault", "faults", kind, TRUTH, (0, 1), bit=b
        )
        for b, fault in enumerate(program.faults)
    ]


def _characteristic(constant: Constant, program: Program, place: CNames) -> Characteristic:
    path = MEMBER.sub("", place(constant.name))
    kind = c_type(constant, program.number)
    table = constant.name.partition(".")[2]
    axes = [c for c in program.constants if re.fullmatch(rf"axis\.{re.escape(table)}_\d", c.name)]
    return Characteristic(
        f"{program.name}.{path}",
        constant.about or constant.key,
        "solved" if constant.kind == "solved" else "calibration",
        path,
        kind,
        conversion_of(constant, program) if constant.kind == "tunable" else COUNT,
        constant.range or LIMITS[kind],
        tuple(Axis(conversion_of(axis, program), axis.items) for axis in axes)
        if constant.items
        else (),
    )
