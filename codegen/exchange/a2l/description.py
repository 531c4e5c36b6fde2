"""Module description: the measurements and characteristics of a Program's C for A2L.

`writer.py` prints a `ModuleDescription` as an A2L file.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from codegen.emit.c_names import CNames, c_type
from codegen.exchange.a2l.compu_method import COUNT, TRUTH, Conversion, conversion_of
from codegen.passes.step_restriction import restrict_to_step
from language.expressions.units import display_unit
from language.ir.number_type import MAX_FINITE
from language.ir.printer import digest
from language.ir.program import Constant, Program, Variable

INSTANCE_STRUCT, PAGE_STRUCT = "Self", "Cal"
"""Suffixes of the C types of the instance and of the calibration page."""
TYPE_LIMITS: Mapping[str, tuple[float, float]] = {
    "double": (-MAX_FINITE["float64"], MAX_FINITE["float64"]),
    "float": (-MAX_FINITE["float32"], MAX_FINITE["float32"]),
    "bool": (0, 1),
    "uint8_t": (0, 2**8 - 1),
    "uint16_t": (0, 2**16 - 1),
    "int16_t": (-(2**15), 2**15 - 1),
    "int32_t": (-(2**31), 2**31 - 1),
    "uint32_t": (0, 2**32 - 1),
}
"""The smallest and largest value of each C type."""
TOOL_GROUP = {"latched": "input", "timer": "memory"}
"""The group in a tool of variables whose own group has another name."""
POINTER_PREFIX = re.compile(r"^(self->|cal->)")
"""The pointer before a member of the instance or of the page."""


@dataclass(frozen=True)
class Measurement:
    """A value in the instance.

    `path` is its member path in `X_Self`. `size` is the length of an array, 0 for a scalar. `bit`
    is the index of a bit of a word, -1 for the whole word.
    """

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
    """An axis of a table with its fixed points."""

    conversion: Conversion
    points: tuple[float, ...]


@dataclass(frozen=True)
class Characteristic:
    """A value, curve or map on the calibration page; `path` is its member path in `X_Cal`."""

    name: str
    about: str
    group: str
    path: str
    type: str
    conversion: Conversion
    limits: tuple[float, float]
    axes: tuple[Axis, ...] = ()


@dataclass(frozen=True)
class ModuleDescription:
    """The measurements and characteristics of the C of one Program."""

    name: str
    digest: str
    about: str
    measurements: tuple[Measurement, ...]
    characteristics: tuple[Characteristic, ...]

    @property
    def groups(self) -> dict[str, list[Measurement | Characteristic]]:
        """The characteristics, then the measurements, by group in order of first occurrence."""
        by_group: dict[str, list[Measurement | Characteristic]] = {}
        every: list[Measurement | Characteristic] = [*self.characteristics, *self.measurements]
        for one in every:
            by_group.setdefault(one.group, []).append(one)
        return by_group


def describe_module(program: Program) -> ModuleDescription:
    """Return the measurements and characteristics of the C of a Program.

    Measurements are the variables in the instance (not inputs and `work.`), then the derived
    constants, then one bit for each fault. Characteristics are the tunable and solved constants.
    Names begin with `<program>.`; the digest is that of the whole Program.
    """
    step_program = restrict_to_step(program)
    c_names = CNames(step_program, solved_prefix="cal->solved.")
    measured = [
        found
        for variable in step_program.variables
        if (found := _measurement(variable, step_program, c_names)) is not None
    ]
    derived = [
        _derived_measurement(c, step_program, c_names)
        for c in step_program.constants
        if c.kind == "derived"
    ]
    page = [
        _characteristic(c, step_program, c_names)
        for c in step_program.constants
        if c.kind in ("tunable", "solved")
    ]
    pace = f"every {float(step_program.period):g} s" if step_program.period else "every major step"
    return ModuleDescription(
        step_program.name,
        digest(program),
        f"{step_program.name}, {pace}",
        (*measured, *derived, *_fault_measurements(step_program)),
        tuple(page),
    )


def _measurement(variable: Variable, program: Program, c_names: CNames) -> Measurement | None:
    """Return the measurement of a variable; None for a variable that is not in the instance."""
    text = c_names(variable.name)
    if not text.startswith("self->"):
        return None
    group = variable.name.partition(".")[0]
    kind = c_type(variable, program.number_type)
    path = POINTER_PREFIX.sub("", text)
    return Measurement(
        f"{program.name}.{variable.name}",
        variable.about or f"{display_unit(variable.unit)}",
        TOOL_GROUP.get(group, group),
        path,
        kind,
        conversion_of(variable, program),
        variable.range or TYPE_LIMITS[kind],
        variable.size,
    )


def _derived_measurement(constant: Constant, program: Program, c_names: CNames) -> Measurement:
    """Return the measurement of a derived constant, which is in the instance."""
    path = POINTER_PREFIX.sub("", c_names(constant.name))
    kind = c_type(constant, program.number_type)
    conversion = conversion_of(constant, program)
    about = constant.about or constant.key
    return Measurement(
        f"{program.name}.{constant.name}",
        about,
        "derived",
        path,
        kind,
        conversion,
        TYPE_LIMITS[kind],
    )


def _fault_measurements(program: Program) -> list[Measurement]:
    """Return one measurement for each bit of the fault word."""
    name, kind = f"{program.name}.memory.faults", "uint32_t"
    return [
        Measurement(
            f"{name}.{fault}", f"fault {fault}", "fault", "faults", kind, TRUTH, (0, 1), bit=b
        )
        for b, fault in enumerate(program.faults)
    ]


def _characteristic(constant: Constant, program: Program, c_names: CNames) -> Characteristic:
    """Return the characteristic of a tunable parameter or solved number, with its axes."""
    path = POINTER_PREFIX.sub("", c_names(constant.name))
    kind = c_type(constant, program.number_type)
    table = constant.name.partition(".")[2]
    axes = [c for c in program.constants if re.fullmatch(rf"axis\.{re.escape(table)}_\d", c.name)]
    return Characteristic(
        f"{program.name}.{path}",
        constant.about or constant.key,
        "solved" if constant.kind == "solved" else "calibration",
        path,
        kind,
        conversion_of(constant, program) if constant.kind == "tunable" else COUNT,
        constant.range or TYPE_LIMITS[kind],
        tuple(Axis(conversion_of(axis, program), axis.items) for axis in axes)
        if constant.items
        else (),
    )
