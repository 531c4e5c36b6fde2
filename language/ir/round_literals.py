"""Working: every real of a Program rounded to the type that it computes in, once.

Whoever lowers writes `real(value)` with an exact or a double value and need not think of the type.
"""

from __future__ import annotations

import dataclasses
from typing import TypeVar

from language.ir.number_type import NumberType, round_to_type
from language.ir.ops import Block, Value
from language.ir.program import Constant, Program

NodeT = TypeVar("NodeT")


def round_program(program: Program) -> Program:
    """Return the program with literals and constants in its number type."""
    number = program.number_type
    if number == "float64":
        return program
    return dataclasses.replace(
        program,
        constants=tuple(_round_constant(constant, number) for constant in program.constants),
        blocks={name: round_block(block, number) for name, block in program.blocks.items()},
    )


def round_block(block: Block, number_type: NumberType) -> Block:
    """Return a block with its literals in a number type."""
    return block if number_type == "float64" else _round_node(block, number_type)


def _round_constant(constant: Constant, number_type: NumberType) -> Constant:
    """What was computed at check time in double is rounded here, once."""
    limits = constant.range
    return dataclasses.replace(
        constant,
        value=round_to_type(constant.value, number_type)
        if constant.type == "real"
        else constant.value,
        items=tuple(round_to_type(item, number_type) for item in constant.items),
        range=(round_to_type(limits[0], number_type), round_to_type(limits[1], number_type))
        if limits
        else None,
    )


def _round_node(part: NodeT, number_type: NumberType) -> NodeT:
    """Return an operation, an expression or a tuple of them, whatever kinds there may be."""
    if isinstance(part, Value):
        return part.round_to_type(number_type)  # type: ignore[return-value]
    if isinstance(part, tuple):
        return tuple([_round_node(item, number_type) for item in part])  # type: ignore[return-value]
    if dataclasses.is_dataclass(part) and not isinstance(part, type):
        changed = {}
        for field in dataclasses.fields(part):
            old = getattr(part, field.name)
            new = _round_node(old, number_type)
            if new is not old:
                changed[field.name] = new
        return dataclasses.replace(part, **changed) if changed else part
    return part
