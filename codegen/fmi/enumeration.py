"""Enumeration: modes and named values of a Program as types of FMI, an item for each number."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from codegen.names import enumerations
from language.ir.program import MODE_VARIABLE, ModeInfo, Program, mode_variable

RUN_MODE = "memory.run_mode"
PREFIX = "type."
"""Stands before names of types: FMI wants them different from names of variables."""


@dataclass(frozen=True)
class Enumeration:
    """A type: its name, and its items, each a name and a number that need not start at 0."""

    name: str
    items: tuple[tuple[str, int], ...]


def enumerations_of(program: Program) -> tuple[Enumeration, ...]:
    """Return the types of a Program: the modes of each region, then lists of names."""
    types = [_mode_enumeration("mode", program.modes)]
    types += [_mode_enumeration(f"region.{info.name}", info.modes) for info in program.regions]
    if program.run_modes:
        types.append(_mode_enumeration("run_mode", program.run_modes))
    types += [
        Enumeration(f"{PREFIX}values.{name}", tuple((value, k) for k, value in enumerate(values)))
        for name, values in enumerations(program)
    ]
    return tuple(types)


def enumeration_name(program: Program, name: str, values: tuple[str, ...] = ()) -> str:
    """Return the name of the type of a variable or constant; an empty text where it has none."""
    if name == MODE_VARIABLE:
        return f"{PREFIX}mode"
    if name == RUN_MODE:
        return f"{PREFIX}run_mode"
    for region in program.regions:
        if name == mode_variable(MODE_VARIABLE, region.name):
            return f"{PREFIX}region.{region.name}"
    owners = (owner for owner, known in enumerations(program) if known == values)
    return f"{PREFIX}values.{next(owners)}" if values else ""


def _mode_enumeration(name: str, modes: Iterable[ModeInfo]) -> Enumeration:
    return Enumeration(f"{PREFIX}{name}", tuple((mode.name, mode.number) for mode in modes))
