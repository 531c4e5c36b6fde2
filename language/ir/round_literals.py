"""Literal rounding: the pass that rounds all reals of a Program to its number type (rule 17a).

    numbers float32:  x := 0.1  ->  x := 0.10000000149011612

Each literal is rounded once. Lowering creates literals with `real(value)` from exact or double
values and ignores the type.
"""

from __future__ import annotations

import dataclasses

from language.ir.number_type import NumberType, round_to_type
from language.ir.ops import Block, Expr, Value
from language.ir.program import Constant, Program
from language.ir.rewrite_ops import map_expressions, map_operands


def round_program(program: Program) -> Program:
    """Return a Program with its literals and constants rounded to its number type.

    Of a real constant these are the value, the array items and the range. A Program in float64 is
    returned unchanged. The bodies of functions are not changed: they exist for each type.
    """
    number = program.number_type
    if number == "float64":
        return program
    return dataclasses.replace(
        program,
        constants=tuple(_round_constant(constant, number) for constant in program.constants),
        blocks={name: round_block(block, number) for name, block in program.blocks.items()},
    )


def round_block(block: Block, number_type: NumberType) -> Block:
    """Return a block with its real literals, inner blocks included, rounded to a number type.

    For float64 the same block is returned.
    """
    if number_type == "float64":
        return block

    def rounded(expr: Expr) -> Expr:
        """Return an expression with its literals rounded."""
        return (
            expr.round_to_type(number_type)
            if isinstance(expr, Value)
            else map_operands(expr, rounded)
        )

    return map_expressions(block, rounded)


def _round_constant(constant: Constant, number_type: NumberType) -> Constant:
    """Return a real constant with its value, its array items and its range rounded to a type.

    Other constants are returned unchanged: a float32 has not all whole numbers.
    """
    if constant.type != "real":
        return constant
    limits = constant.range
    return dataclasses.replace(
        constant,
        value=round_to_type(constant.value, number_type),
        items=tuple(round_to_type(item, number_type) for item in constant.items),
        range=(round_to_type(limits[0], number_type), round_to_type(limits[1], number_type))
        if limits
        else None,
    )
