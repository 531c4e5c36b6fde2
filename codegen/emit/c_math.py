"""ha_math: elementary functions as C99 whose bits do not depend on a C library (rule C6)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from codegen.emit.c_expression import MATH_SUFFIX, LocalNames, emit_expression, format_literal
from codegen.emit.c_names import C_REAL_TYPE
from codegen.emit.c_statement import (
    INDENT,
    MAX_LINE_WIDTH,
    emit_select,
    emit_wrapped_statement,
    is_nested,
)
from codegen.toolchain.templates import product_version, render
from language.ir.number_type import NumberType
from language.ir.ops import Assign, Select
from language.ir.program import Function, unqualified_name
from language.numerics.function_table import FUNCTIONS_BY_TYPE
from language.numerics.payne_hanek import (
    ANGLE_FORMATS,
    HALF_PI,
    WINDOW_BITS,
    WORD_BITS,
    ZERO_BITS,
    AngleFormat,
)


@dataclass(frozen=True)
class FloatFormat:
    """A format of IEEE 754: total bits, fraction bits, lowest and highest normal exponent."""

    bits: int
    digits: int
    lowest: int
    highest: int


FLOAT_FORMATS: Mapping[NumberType, FloatFormat] = {
    "float64": FloatFormat(64, 52, -1022, 1023),
    "float32": FloatFormat(32, 23, -126, 127),
}


def emit_math_files(number: NumberType) -> dict[str, str]:
    """Return the header and source of ha_math by file name (rule C6).

    The names are `ha_math.h` and `ha_math.c`, for float32 `ha_mathf.h` and `ha_mathf.c`. They hold
    all functions of FUNCTIONS_BY_TYPE, used or not.
    """
    suffix = MATH_SUFFIX[number]
    context = {
        **_number_context(number),
        "functions": [
            _function_context(function, number) for function in FUNCTIONS_BY_TYPE[number].values()
        ],
        "layout": FLOAT_FORMATS[number],
        "reduction": _reduction_context(ANGLE_FORMATS[number]),
        "lowest": format_literal(float(FLOAT_FORMATS[number].lowest), number),
        "highest": format_literal(float(FLOAT_FORMATS[number].highest), number),
    }
    return {
        f"ha_math{suffix}.h": render("emit/ha_math.h.jinja", context),
        f"ha_math{suffix}.c": render("emit/ha_math.c.jinja", context),
    }


def _reduction_context(form: AngleFormat) -> dict[str, Any]:
    """Return what the template of the Payne-Hanek reduction needs: the table, places and masks."""
    size = form.digits + 1
    return {
        "words": form.words,
        "zero_words": ZERO_BITS // WORD_BITS,
        "window_words": WINDOW_BITS // WORD_BITS,
        "lowest": form.lowest,
        "highest": form.highest,
        "first_place": form.first_place,
        "fraction_mask": f"0x{2**form.digits - 1:X}U",
        "leading_bit": f"0x{2**form.digits:X}U",
        "full_mantissa": f"0x{2**size - 1:X}U",
        "half_pi": f"0x{HALF_PI:X}U",
        "head_place": 64 - size,
        "tail_place": max(0, 64 - 2 * size),
        "rests": {step: f"0x{2 ** (64 - step) - 1:X}U" for step in (32, 16, 8, 4, 2, 1)},
        "tail_mask": f"0x{2 ** (64 - size - max(0, 64 - 2 * size)) - 1:X}U",
    }


def emit_page_header(number: NumberType) -> dict[str, str]:
    """Return the header `ha_page.h`, for float32 `ha_pagef.h`, by its file name (rule C14).

    It holds the lookups of tables on a calibration page, whose values are volatile. They have the
    bits of the lookups of ha_math.
    """
    text = render("emit/ha_page.h.jinja", _number_context(number))
    return {f"ha_page{MATH_SUFFIX[number]}.h": text}


def _number_context(number: NumberType) -> dict[str, Any]:
    """Return what the templates of all headers need: version, C type, suffix, 0 and 1."""
    return {
        "version": product_version(),
        "real": C_REAL_TYPE[number],
        "suffix": MATH_SUFFIX[number],
        "zero": format_literal(0.0, number),
        "one": format_literal(1.0, number),
    }


def _function_context(function: Function, number: NumberType) -> dict[str, Any]:
    """Return the template context of one function: its name, parameters, comment and lines."""
    c_names = LocalNames(unqualified_name, number)
    lines: list[str] = []
    for op in function.body:
        assert isinstance(op, Assign)
        left = (
            "return "
            if op.target == "work.y"
            else f"const {C_REAL_TYPE[number]} {c_names(op.target)} = "
        )
        if isinstance(op.value, Select) and is_nested(op.value):
            lines += emit_select(
                C_REAL_TYPE[number],
                c_names(op.target),
                op.value,
                c_names,
                MAX_LINE_WIDTH - len(INDENT),
            )
            lines += ["return y;"] if op.target == "work.y" else []
        else:
            lines += emit_wrapped_statement(
                left, emit_expression(op.value, c_names), "", MAX_LINE_WIDTH - len(INDENT)
            )
    parameters = ", ".join(f"{C_REAL_TYPE[number]} {name}" for name in function.parameters)
    about = function.about
    return {"name": function.name, "parameters": parameters, "about": about, "lines": lines}
