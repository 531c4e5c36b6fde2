"""Working: every real of a Program rounded to the type that it computes in, once.

Whoever lowers writes `real(value)` with an exact or a double value and need not think of the type.
"""

from __future__ import annotations

import dataclasses
from typing import TypeVar

from language.number import NumberType, rounded
from language.operation import Block, Value
from language.program import Constant, Program

Part = TypeVar("Part")


def in_working_type(program: Program) -> Program:
    """Return the program with literals and constants in its number type."""
    number = program.number
    if number == "float64":
        return program
    return dataclasses.replace(
        program,
        constants=tuple(_constant(constant, number) for constant in program.constants),
        blocks={name: working(block, number) for name, block in program.blocks.items()},
    )


def working(block: Block, number: NumberType) -> Block:
    """Return a block with its literals in a number type."""
    return block if number == "float64" else _part(block, number)


def _constant(constant: Constant, number: NumberType) -> Constant:
    """What was computed at check time in double is rounded here, once."""
    limits = constant.range
    return dataclasses.replace(
        constant,
        value=rounded(constant.value, number) if constant.type == "real" else constant.value,
        items=tuple(rounded(item, number) for item in constant.items),
        range=(rounded(limits[0], number), rounded(limits[1], number)) if limits else None,
    )


def _part(part: Part, number: NumberType) -> Part:
    """Return an operation, an expression or a tuple of them, whatever kinds there may be."""
    if isinstance(part, Value):
        return part.rounded(number)  # type: ignore[return-value]
    if isinstance(part, tuple):
        return tuple([_part(item, number) for item in part])  # type: ignore[return-value]
    if dataclasses.is_dataclass(part) and not isinstance(part, type):
        changed = {}
        for field in dataclasses.fields(part):
            old = getattr(part, field.name)
            new = _part(old, number)
            if new is not old:
                changed[field.name] = new
        return dataclasses.replace(part, **changed) if changed else part
    return part
